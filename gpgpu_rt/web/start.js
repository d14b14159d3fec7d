// Handles the page's events, and starts the page.

let dragging = false, listens = false;

// Calls `turned` with each movement (dx, dy) of a drag, `ended` after the drag, and `clicked` after a press without a
// drag.
function onDrag(one, turned, clicked, ended) {
    let from = null, moved = false, pressed = null;     // from: the previous place; pressed: the pressed pointer
    one.addEventListener("pointerdown", (event) => {
        if (event.button !== 0 || !event.isPrimary) return;
        [pressed, moved, from] = [event.pointerId, false, [event.clientX, event.clientY]];
        one.setPointerCapture(event.pointerId);
    });
    one.addEventListener("pointermove", (event) => {
        if (event.pointerId !== pressed) return;
        const way = [event.clientX - from[0], event.clientY - from[1]];
        if (!moved && Math.hypot(...way) < 4) return;
        [moved, from] = [true, [event.clientX, event.clientY]];
        turned(...way);
    });
    const end = (event) => {
        if (event.pointerId !== pressed) return;
        pressed = null;
        if (moved) ended();
        else if (event.type === "pointerup") clicked(event);
    };
    for (const kind of ["pointerup", "pointercancel"]) one.addEventListener(kind, end);
}

const touches = new Map();      // finger on the drawing -> its place on the page

// Calls `zoomed` with a factor and a place on the page when the reader turns the wheel or moves two fingers. `zoomed`
// returns whether the zoom has changed. If not, the wheel scrolls the page.
function onZoom(one, zoomed) {
    const place = (event) => [event.clientX, event.clientY];
    one.addEventListener("wheel", (event) => {
        // The pinch of a trackpad arrives as a slower wheel, with the control key.
        const factor = Math.exp(-event.deltaY * (event.ctrlKey ? 0.01 : 0.003));
        if (zoomed(factor, place(event)) || event.ctrlKey) event.preventDefault();
    }, {passive: false});
    one.addEventListener("pointerdown", (event) => {
        if (event.pointerType === "touch") touches.set(event.pointerId, place(event));
    });
    one.addEventListener("pointermove", (event) => {
        if (!touches.has(event.pointerId)) return;
        const [a, b] = touches.values();
        touches.set(event.pointerId, place(event));
        if (touches.size !== 2) return;
        const [c, d] = touches.values(), length = (p, q) => Math.hypot(p[0] - q[0], p[1] - q[1]);
        zoomed(length(c, d) / Math.max(1, length(a, b)), c.map((x, k) => (x + d[k]) / 2));
    });
    for (const kind of ["pointerup", "pointercancel"]) {
        one.addEventListener(kind, (event) => touches.delete(event.pointerId));
    }
}

function turnCamera(dx, dy) {
    dragging = true;
    const {eye, target: at, up} = chosen.camera, offset = eye.map((x, k) => x - at[k]);
    const turned = rotated(rotated(offset, unit(up), -0.01 * dx), unit(cross(offset, up)), 0.01 * dy);
    const moved = turned.map((x, k) => x + at[k]);
    if (!sideways(moved, chosen.camera)) return;
    chosen.camera = {...chosen.camera, eye: moved};
    show();
}

function pick(event) {
    const box = canvas.getBoundingClientRect();
    chosen.ray = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height]
        .map((at) => Math.max(0, Math.min(1, at)));
    show();
}

function goTo(step) {
    chosen.most = step;
    steps();
    show();
}

function play() {
    if (playing) {
        playing = false;
        return;
    }
    if (presentSurvey() && chosen.most >= counted.last) chosen.most = null;
    show(true);
}

function listen() {
    const on = (id, kind, does) => element(id).addEventListener(kind, does);
    on("method", "change", () => choose(chosen.asked, chosen.most));
    on("schedule", "change", () => choose(element("schedule").value, null));
    on("heat", "change", () => {
        chosen.heat = element("heat").checked;
        show();
    });
    on("scale", "change", () => {
        rescale(Math.max(1, Number(element("scale").value) || 1));
        show();
    });
    on("percentile", "click", () => {
        if (presentSurvey()) rescale(counted.percentile);
        show();
    });
    on("kernel", "change", () => {
        showProgram();
        spaceAt();
    });
    on("pass", "input", () => goTo(Number(element("pass").value)));
    on("end", "click", () => goTo(rayEnd()));
    on("play", "click", play);
    on("size", "change", () => {
        chosen.side = Number(element("size").value);
        show();
    });
    onDrag(canvas, turnCamera, pick, () => {
        dragging = false;
        show();
    });
    onDrag(space, (dx, dy) => touches.size < 2 && turnSpace(-0.01 * dx, 0.01 * dy), () => {}, () => {});
    onZoom(space, zoomSpace);
    addEventListener("hashchange", () => choose(...recall()));
}

function listenToContext() {
    canvas.addEventListener("webglcontextlost", (event) => {
        event.preventDefault();     // otherwise the browser does not restore the context
        lost = true;
        losses += 1;
        element("message").textContent = "The graphics card has stopped. The page waits for it; if nothing happens, "
            + "open the page again.";
    });
    canvas.addEventListener("webglcontextrestored", () => restore().catch(reportProblem));
}

// Recreates everything that the lost context held.
async function restore() {
    const check = watched();
    enableExtensions();
    while (busy) await new Promise((next) => setTimeout(next, 20));    // wait for the interrupted trace to end
    check();
    for (const made of [tables, targets, programs, tableValues, splitTrees, costs]) made.clear();
    result = path = counted = null;
    await begin();
}

// Draws a picture, then prepares the page. If the context is lost, throws LostContext; `restore` then calls `begin`.
async function begin() {
    const check = watched();
    announceTest();
    surfaces = await surfaceTexture();
    if (!listens) listen();
    [listens, lost] = [true, false];
    const shown = choose(...recall());
    if (!wires) await loadWires();
    check();
    spaceAt();
    await shown;
    check();
    drawRamp();
    const {loop} = chosen.method.schedules;
    if (loop) await trace(loop, chosen.camera, 32, 32, {place: "warm"});     // compile the programs that a drag needs
    freeTargets("warm");
    const idle = async () => {
        while (busy && !lost) await new Promise((next) => setTimeout(next, 10));
    };
    check();
    await selfTest(idle);
}

// Tells the reader what failed. Another listener reports a lost context.
function reportProblem(problem) {
    if (!(problem instanceof LostContext)) fail(problem.message);
}

async function start() {
    element("method").replaceChildren(...runnable.map(({name}) => new Option(name, name)));
    listenToContext();
    await begin();
}
start().catch(reportProblem);
