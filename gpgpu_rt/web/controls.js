// The controls of a page: what the reader has chosen, the picture, and the ray of a clicked pixel.

const chosen = {method: page.methods[0], schedule: null, most: null, heat: false, side: 128, ray: null,
                camera: page.camera};
let surfaces = null, result = null, busy = false, wanted = false;

function schedule() {
    return chosen.method.schedules[chosen.schedule];
}

async function show() {
    wanted = true;
    if (busy) return;
    busy = true;
    try {
        await draws();
    } finally {
        busy = false;
    }
}

async function draws() {
    while (wanted) {
        wanted = false;
        const began = performance.now();
        const {side, heat, most} = chosen, drawn = schedule(), stepwise = drawn.repeats;
        const found = await trace(drawn, chosen.camera, side, side,
                                  {most: most === null ? MOST_PASSES : most, stopped: () => wanted});
        if (wanted) continue;
        result = {...found, side, schedule: drawn};
        const [[phase, a], [steps, b]] = stepwise ? [field(drawn, "phase"), field(drawn, "steps")] : [[0, 0], [0, 0]];
        draw(page.whole, page.show, {framebuffer: null, width: canvas.width, height: canvas.height},
             {places: [a, b], stepwise, most: heat && stepwise ? Math.max(result.steps, 1) : 0,
              size: [canvas.width, canvas.height]},
             {hits: result.hit, surfaces, directions: result.directions, phases: result.states[phase],
              counts: result.states[steps]});
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));    // waits for the picture
        const took = performance.now() - began;
        if (most === null && stepwise) element("pass").value = element("pass").max = result.turns;
        element("counts").textContent = `${side} x ${side} rays, ${result.passes} passes`
            + (stepwise ? `, ${result.alive} rays alive, at most ${result.steps} steps` : "")
            + `, ${took.toFixed(0)} ms`;
        if (chosen.ray) describe(...chosen.ray);
        if (!dragging) remember();
        canvas.dataset.shown = Number(canvas.dataset.shown || 0) + 1;
        if (dragging && took > 100 && chosen.side > 32) chosen.side = chosen.side / 2;
    }
}

function choose(most = null) {
    chosen.method = page.methods.find(({name}) => name === element("method").value);
    const names = Object.keys(chosen.method.schedules), list = element("schedule");
    if (!names.includes(chosen.schedule) || list.dataset.owner !== chosen.method.name) {
        list.replaceChildren(...names.map((name) => new Option(name, name)));
        list.dataset.owner = chosen.method.name;
        list.value = names.includes(chosen.schedule) ? chosen.schedule : names[0];
    }
    chosen.schedule = list.value;
    chosen.most = schedule().repeats ? most : null;
    chosen.heat = element("heat").checked;
    for (const id of ["pass", "heat"]) element(id).disabled = !schedule().repeats;
    element("pass").value = element("pass").max = chosen.most || MOST_PASSES;
    element("summary").textContent = `${chosen.method.citation}: ${chosen.method.summary}.`;
    const passes = schedule().passes, listed = element("kernel");
    const first = schedule().repeats ? schedule().cycles[0].turns[0].passes[0] : 1;
    const distinct = passes.map((pass, k) => [pass, k]).filter(
        ([{fragment}], k) => passes.findIndex((one) => one.fragment === fragment) === k);
    listed.replaceChildren(...distinct.map(([{title}, k]) => new Option(title, k)));
    listed.value = distinct.find(([{fragment}]) => fragment === passes[first].fragment)[1];
    showProgram();
    show();
}

function showProgram() {
    element("text").textContent = page.texts[schedule().passes[Number(element("kernel").value)].fragment];
}

let dragging = false, moved = false, from = null;
function turn(event) {
    if (!dragging || !moved && Math.hypot(event.clientX - from[0], event.clientY - from[1]) < 4) return;
    moved = true;
    const [dx, dy] = [event.clientX - from[0], event.clientY - from[1]];
    from = [event.clientX, event.clientY];
    const {eye, target: at, up} = chosen.camera, offset = eye.map((x, k) => x - at[k]);
    const turned = rotated(rotated(offset, unit(up), -0.01 * dx), unit(cross(offset, up)), 0.01 * dy);
    if (!sideways(turned)) return;
    chosen.camera = {...chosen.camera, eye: turned.map((x, k) => x + at[k])};
    show();
}

// Whether a view along `offset` is far enough from the camera's upward direction.
function sideways(offset) {
    return Math.hypot(...cross(unit(offset), unit(chosen.camera.up))) >= 0.1;
}

function rotated(v, axis, angle) {
    const c = Math.cos(angle), s = Math.sin(angle), along = v.reduce((sum, x, k) => sum + x * axis[k], 0);
    const side = cross(axis, v);
    return v.map((x, k) => x * c + side[k] * s + axis[k] * along * (1 - c));
}

function clicked(event) {
    const box = canvas.getBoundingClientRect();
    chosen.ray = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
    show();
}

// Writes the hit and the state of the ray at a place in [0, 1] of the picture.
function describe(across, down) {
    const {side, schedule: drawn} = result;
    const [x, y] = [across, down].map((at) => Math.max(0, Math.min(side - 1, Math.floor(at * side))));
    const at = 4 * (y * side + x), hit = readTexture(result.hit, side, side).slice(at, at + 4);
    const lines = [`ray (${x}, ${y})`, hit[3] === NO_TRIANGLE ? "no hit"
        : `triangle ${hit[3]} at t = ${hit[0]}, u = ${hit[1]}, v = ${hit[2]}`];
    const texels = new Map();
    for (const [name, texel, swizzle] of drawn.state) {
        if (!texels.has(texel)) {
            texels.set(texel, readTexture(result.states[texel], side, side).slice(at, at + 4));
        }
        lines.push(`${name} = ${[...swizzle].map((letter) => texels.get(texel)["xyzw".indexOf(letter)]).join(", ")}`);
    }
    element("ray").textContent = lines.join("\n");
}

// The address keeps the choices after its "#", so that a link shows what its sender saw.
function remember() {
    const told = new URLSearchParams({method: chosen.method.name, schedule: chosen.schedule,
                                      rays: element("size").value});
    if (chosen.most !== null) told.set("pass", chosen.most);
    if (chosen.heat) told.set("heat", 1);
    if (chosen.ray) told.set("ray", chosen.ray.map((at) => at.toFixed(4)).join(","));
    told.set("eye", chosen.camera.eye.map((x) => x.toPrecision(9)).join(","));
    try {
        history.replaceState(null, "", `#${told}`);
    } catch {
        // A browser may limit how often the address changes; the next picture writes it.
    }
}

function recall() {
    const told = new URLSearchParams(location.hash.slice(1));
    const numbers = (name) => (told.get(name) || "").split(",").map(Number);
    if (page.methods.some(({name}) => name === told.get("method"))) element("method").value = told.get("method");
    chosen.schedule = told.get("schedule");
    element("heat").checked = told.has("heat");
    if ([...element("size").options].some(({value}) => value === told.get("rays"))) {
        element("size").value = told.get("rays");
    }
    chosen.side = Number(element("size").value);
    const [ray, eye, pass] = ["ray", "eye", "pass"].map(numbers);
    if (told.has("ray") && ray.length === 2 && ray.every((at) => at >= 0 && at <= 1)) chosen.ray = ray;
    if (told.has("eye") && eye.length === 3 && eye.every(Number.isFinite)
        && sideways(eye.map((x, k) => x - page.camera.target[k]))) chosen.camera = {...chosen.camera, eye};
    return pass[0] >= 1 ? Math.min(Math.floor(pass[0]), MOST_PASSES) : null;
}

async function start() {
    surfaces = await surfaceTexture();
    element("method").replaceChildren(...page.methods.map(({name}) => new Option(name, name)));
    for (const id of ["method", "schedule"]) element(id).addEventListener("change", () => choose());
    element("heat").addEventListener("change", () => {
        chosen.heat = element("heat").checked;
        show();
    });
    element("kernel").addEventListener("change", showProgram);
    element("pass").addEventListener("input", () => {
        chosen.most = Number(element("pass").value);
        show();
    });
    canvas.addEventListener("webglcontextlost", () => fail("The graphics card stopped; open the page again."));
    canvas.addEventListener("pointercancel", () => { dragging = false; });
    canvas.addEventListener("pointerdown", (event) => {
        if (event.button !== 0 || !event.isPrimary) return;
        dragging = true;
        moved = false;
        from = [event.clientX, event.clientY];
        canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", turn);
    canvas.addEventListener("pointerup", (event) => {
        if (!dragging) return;
        dragging = false;
        chosen.side = Number(element("size").value);
        if (!moved) clicked(event);
        else show();
    });
    element("size").addEventListener("change", () => {
        chosen.side = Number(element("size").value);
        show();
    });
    choose(recall());
    await selfTest();
    show();
}
start().catch((problem) => fail(problem.message));
