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
    while (wanted) {
        wanted = false;
        const began = performance.now();
        const most = chosen.most === null ? MOST_PASSES : chosen.most;
        result = await trace(schedule(), chosen.camera, chosen.side, chosen.side, {most});
        const stepwise = schedule().repeats;
        const [[phase, a], [steps, b]] = stepwise ? [field(schedule(), "phase"), field(schedule(), "steps")]
            : [[0, 0], [0, 0]];
        draw(page.whole, page.show, {framebuffer: null, width: canvas.width, height: canvas.height},
             {places: [a, b], stepwise, most: chosen.heat && stepwise ? Math.max(result.steps, 1) : 0,
              size: [canvas.width, canvas.height]},
             {hits: result.hit, surfaces, directions: result.directions, phases: result.states[phase],
              counts: result.states[steps]});
        gl.finish();
        const took = performance.now() - began;
        if (chosen.most === null && stepwise) element("pass").max = result.passes;
        element("counts").textContent = `${chosen.side} x ${chosen.side} rays, ${result.passes} passes`
            + (stepwise ? `, ${result.alive} rays alive, at most ${result.steps} steps` : "")
            + `, ${took.toFixed(0)} ms`;
        if (chosen.ray) describe(...chosen.ray);
        remember();
        canvas.dataset.shown = Number(canvas.dataset.shown || 0) + 1;
        if (dragging && took > 100 && chosen.side > 32) chosen.side = chosen.side / 2;
    }
    busy = false;
}

function choose() {
    chosen.method = page.methods.find(({name}) => name === element("method").value);
    const names = Object.keys(chosen.method.schedules), list = element("schedule");
    if (!names.includes(chosen.schedule) || list.dataset.owner !== chosen.method.name) {
        list.replaceChildren(...names.map((name) => new Option(name, name)));
        list.dataset.owner = chosen.method.name;
        list.value = names.includes(chosen.schedule) ? chosen.schedule : names[0];
    }
    chosen.schedule = list.value;
    chosen.most = null;
    chosen.heat = element("heat").checked;
    for (const id of ["pass", "heat"]) element(id).disabled = !schedule().repeats;
    element("pass").value = element("pass").max = MOST_PASSES;
    element("summary").textContent = `${chosen.method.citation}: ${chosen.method.summary}.`;
    const passes = schedule().passes, listed = element("kernel");
    listed.replaceChildren(...passes.map((one, k) => new Option(one.name, k)));
    listed.value = passes.length - 1;
    showProgram();
    show();
}

function showProgram() {
    element("text").textContent = page.texts[schedule().passes[Number(element("kernel").value)].fragment];
}

let dragging = false, moved = false, from = null;
function turn(event) {
    if (!dragging) return;
    moved = true;
    const [dx, dy] = [event.clientX - from[0], event.clientY - from[1]];
    from = [event.clientX, event.clientY];
    const {eye, target: at, up} = chosen.camera, offset = eye.map((x, k) => x - at[k]);
    const turned = rotated(rotated(offset, unit(up), -0.01 * dx), unit(cross(offset, up)), 0.01 * dy);
    if (Math.hypot(...cross(unit(turned), unit(up))) < 0.1) return;
    chosen.camera = {...chosen.camera, eye: turned.map((x, k) => x + at[k])};
    show();
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
    const side = chosen.side, [x, y] = [across, down].map((at) => Math.min(side - 1, Math.floor(at * side)));
    const at = 4 * (y * side + x), hit = readTexture(result.hit, side, side).slice(at, at + 4);
    const lines = [`ray (${x}, ${y})`, hit[3] === NO_TRIANGLE ? "no hit"
        : `triangle ${hit[3]} at t = ${hit[0]}, u = ${hit[1]}, v = ${hit[2]}`];
    const texels = new Map();
    for (const [name, texel, swizzle] of schedule().state) {
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
    told.set("eye", chosen.camera.eye.map((x) => x.toPrecision(7)).join(","));
    history.replaceState(null, "", `#${told}`);
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
    if (told.has("eye") && eye.length === 3 && eye.every(Number.isFinite)) chosen.camera = {...chosen.camera, eye};
    return told.has("pass") && pass[0] >= 1 ? Math.floor(pass[0]) : null;
}

async function start() {
    surfaces = texture(page.surfaces.size[0], page.surfaces.size[1], 4, await floats(page.surfaces.data));
    element("method").replaceChildren(...page.methods.map(({name}) => new Option(name, name)));
    for (const id of ["method", "schedule", "heat"]) element(id).addEventListener("change", choose);
    element("kernel").addEventListener("change", showProgram);
    element("pass").addEventListener("input", () => {
        chosen.most = Number(element("pass").value);
        show();
    });
    canvas.addEventListener("pointerdown", (event) => {
        dragging = true;
        moved = false;
        from = [event.clientX, event.clientY];
        canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", turn);
    canvas.addEventListener("pointerup", (event) => {
        dragging = false;
        chosen.side = Number(element("size").value);
        if (!moved) clicked(event);
        else show();
    });
    element("size").addEventListener("change", () => {
        chosen.side = Number(element("size").value);
        show();
    });
    const most = recall();
    choose();
    if (most !== null && schedule().repeats) chosen.most = most;
    await selfTest();
    show();
}
start().catch((problem) => fail(problem.message));
