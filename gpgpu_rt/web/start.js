// The page's events, and its start.

let dragging = false;

// Calls `turned` with each way of a drag over an element, `ended` after the drag, and `clicked` after a press alone.
function onDrag(one, turned, clicked, ended) {
    let from = null, moved = false, pressed = false;
    one.addEventListener("pointerdown", (event) => {
        if (event.button !== 0 || !event.isPrimary) return;
        [pressed, moved, from] = [true, false, [event.clientX, event.clientY]];
        one.setPointerCapture(event.pointerId);
    });
    one.addEventListener("pointermove", (event) => {
        const way = pressed ? [event.clientX - from[0], event.clientY - from[1]] : [0, 0];
        if (!pressed || !moved && Math.hypot(...way) < 4) return;
        [moved, from] = [true, [event.clientX, event.clientY]];
        turned(...way);
    });
    const end = (event) => {
        if (!pressed) return;
        pressed = false;
        if (moved) ended();
        else if (event.type === "pointerup") clicked(event);
    };
    for (const kind of ["pointerup", "pointercancel"]) one.addEventListener(kind, end);
}

function turnCamera(dx, dy) {
    dragging = true;
    const {eye, target: at, up} = chosen.camera, offset = eye.map((x, k) => x - at[k]);
    const turned = rotated(rotated(offset, unit(up), -0.01 * dx), unit(cross(offset, up)), 0.01 * dy);
    if (!sideways(turned)) return;
    chosen.camera = {...chosen.camera, eye: turned.map((x, k) => x + at[k])};
    show();
}

function pick(event) {
    const box = canvas.getBoundingClientRect();
    chosen.ray = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height]
        .map((at) => Math.max(0, Math.min(1, at)));
    show();
}

function turnSpace(dx, dy) {
    spaceView.yaw -= 0.01 * dx;
    spaceView.pitch = Math.max(-1.4, Math.min(1.4, spaceView.pitch + 0.01 * dy));
    spaceAt();
}

function scrub() {
    chosen.most = Number(element("pass").value);
    steps();
    show();
}

function play() {
    if (playing) {
        playing = false;
        return;
    }
    if (chosen.most !== null && counted && chosen.most >= counted.last) chosen.most = null;
    show(true);
}

function listen() {
    const on = (id, kind, does) => element(id).addEventListener(kind, does);
    for (const id of ["method", "schedule"]) on(id, "change", () => choose());
    on("heat", "change", () => {
        chosen.heat = element("heat").checked;
        show();
    });
    on("scale", "change", () => {
        rescale(Math.max(1, Number(element("scale").value) || 1));
        show();
    });
    on("percentile", "click", () => {
        if (counted) rescale(counted.percentile);
        show();
    });
    on("kernel", "change", () => {
        showProgram();
        spaceAt();
    });
    on("pass", "input", scrub);
    on("play", "click", play);
    on("size", "change", () => {
        chosen.side = Number(element("size").value);
        show();
    });
    onDrag(canvas, turnCamera, pick, () => {
        dragging = false;
        show();
    });
    onDrag(space, turnSpace, () => {}, () => {});
    addEventListener("hashchange", () => choose(recall()));
    canvas.addEventListener("webglcontextlost", (event) => {
        event.preventDefault();     // else the browser restores no context
        lost = true;
        element("message").textContent = "The graphics card has stopped. The page waits for it; if nothing happens, "
            + "open the page again.";
    });
    canvas.addEventListener("webglcontextrestored", () => restore().catch((problem) => fail(problem.message)));
}

// Makes everything again that the lost context held.
async function restore() {
    for (const made of [tables, targets, programs, costs]) made.clear();
    result = path = null;
    enableExtensions();
    while (busy) await new Promise((next) => setTimeout(next, 20));    // the trace that was interrupted
    for (const made of [tables, targets, programs]) made.clear();
    lost = false;
    element("message").textContent = "";
    await begin();
}

// Draws the first picture, and only then makes what the picture does not need.
async function begin() {
    surfaces = await surfaceTexture();
    await choose(recall());
    waiting = drawLegends();
    rescale(chosen.scale);
    if (!wires) await loadWires();
    spaceAt();
    const {loop} = chosen.method.schedules;
    if (loop) await trace(loop, chosen.camera, 32, 32, {place: "warm"});     // compiles what a drag needs
    freeTargets("warm");
    const idle = async () => {
        while (busy && !lost) await new Promise((next) => setTimeout(next, 10));
    };
    await selfTest(idle, isLost);
}

async function start() {
    element("method").replaceChildren(...page.methods.map(({name}) => new Option(name, name)));
    listen();
    await begin();
}
start().catch((problem) => {
    if (!isLost()) fail(problem.message);
});
