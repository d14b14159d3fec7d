// The controls of a page: what the reader has chosen, the pictures, and the ray of a clicked pixel.

const opening = runnable.find(({name}) => name === page.opens) || runnable[0];
// The page opens a method with the first of these schedules that the method has. `loop` has no steps to show.
const OPENS = ["step", "kernels", "loop"];
// `asked` is the schedule that the reader chose, and `schedule` the schedule in use. They differ if the method does not
// have the schedule `asked`.
const chosen = {method: opening, schedule: null, asked: OPENS[0], most: null, heat: false, scale: null,
                side: opening.test.side, ray: null, camera: page.camera};
const ANSWER = 40;          // milliseconds that a picture may take while the camera turns
const PROGRESS = 250;       // milliseconds between two pictures of an unfinished trace
const PLAYED = 240;         // approximate number of pictures when a search is played
const SIDES = [512, 384, 256, 192, 128, 96, 64, 48, 32];
let surfaces = null, result = null, busy = false, wanted = false, playing = false, lost = false;
let counted = null, path = null;    // the result of `survey` for a whole search, and the path of the clicked ray

function schedule() {
    return chosen.method.schedules[chosen.schedule];
}

// Returns whether the WebGL context is lost. The event that sets `lost` may arrive later than the loss.
function isLost() {
    return lost || gl.isContextLost();
}

// Traces and shows the chosen picture. With `plays`, shows one step after another, from the present step on.
async function show(plays = false) {
    wanted = true;
    playing = plays;
    element("play").textContent = playing ? "pause" : "play";
    if (busy || lost) return;
    busy = true;
    try {
        while (wanted) await draws();
    } catch (problem) {
        if (!(problem instanceof LostContext || isLost())) throw problem;
    } finally {
        busy = false;
    }
}

async function draws() {
    wanted = false;
    const began = performance.now(), dragged = dragging, {method, camera, most} = chosen;
    const {name, side} = dragged ? quick() : {name: chosen.schedule, side: chosen.side};
    const drawn = method.schedules[name], stepwise = drawn.repeats, ends = () => wanted && !dragged;
    const counts = stepwise && !dragged && most !== null && !playing;
    // A heat map without a scale needs the counts of a whole search first.
    if (counts && chosen.heat && chosen.scale === null) await countWhole(drawn, camera, side);
    if (ends()) return;
    const plays = playing && stepwise, from = most === null ? 0 : most;
    const shows = plays ? played(from, drawn, camera, side) : dragged ? () => {} : progress(began, drawn, camera, side);
    const limit = plays || !stepwise || most === null ? MOST_TURNS : most;
    let reached = 0;
    const seen = (states, step) => {
        reached = step;
        return shows(states, step);
    };
    const paused = () => plays && !playing && reached > from;
    // Counting live packets reads a texture back after every turn, so count them only in whole searches, for `count`.
    const lives = [], whole = limit === MOST_TURNS && drawn.cycles.length === 1 && !dragged;
    const found = await trace(drawn, camera, side, side, {most: limit, stopped: () => ends() || paused(), seen,
                                                          lives: whole ? lives : null});
    if (ends()) return;
    if (stepwise && limit === MOST_TURNS && found.alive === 0 && !dragged) count(drawn, found, lives, camera, side);
    // The reader may have paused between two shown steps, so take the reached step from the trace.
    if (plays) [playing, chosen.most] = [false, playing || found.alive === 0 ? null : found.turns];
    element("play").textContent = "play";
    paint(found, drawn, camera, side);
    element("message").textContent = "";
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));    // waits for the picture
    const took = performance.now() - began;
    costs.set(costKey(name), {side, took});
    element("counts").textContent = `${side} x ${side} rays, ${found.passes} ${found.passes === 1 ? "pass" : "passes"}`
        + (stepwise ? `, ${found.alive} ${searchers(drawn)} alive, at most ${found.steps} ${stepNoun(drawn)}` : "")
        + `, ${took.toFixed(0)} ms`;
    canvas.dataset.shown = Number(canvas.dataset.shown || 0) + 1;
    if (dragged) return;
    freeTargets("picture", true);
    await follow();
    remember();
    if (counts && !wanted) await countWhole(drawn, camera, side);
}

// Traces the whole search again, to count the live rays after each step, unless they are already counted.
async function countWhole(drawn, camera, side) {
    if (presentSurvey()) return;
    const lives = [];
    const whole = await trace(drawn, camera, side, side, {place: "count", stopped: () => wanted,
                                                          lives: drawn.cycles.length === 1 ? lives : null});
    if (!wanted) count(drawn, whole, lives, camera, side);
    freeTargets("count");
}

function paint(found, drawn, camera, side) {
    const stepwise = drawn.repeats;
    const [[phase, a], [steps, b]] = stepwise ? ["phase", "steps"].map((name) => field(drawn, name)) : [[0, 0], [0, 0]];
    draw(page.own.whole, page.own.show, {framebuffer: null, width: canvas.width, height: canvas.height},
         {places: [a, b], stepwise, most: chosen.heat && stepwise ? chosen.scale || 1 : 0,
          size: [canvas.width, canvas.height], ...SHOWN_COLOURS},
         {hits: found.hit, surfaces, directions: found.directions, phases: found.states[phase],
          counts: found.states[steps]});
    result = {...found, side, camera, schedule: drawn};
}

// Returns the function that shows an unfinished trace every PROGRESS milliseconds.
function progress(began, drawn, camera, side) {
    let last = began;
    return async (states, step) => {
        if (performance.now() - last < PROGRESS || !drawn.repeats) return;
        paint(states, drawn, camera, side);
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
        element("counts").textContent = `${side} x ${side} rays, ${step} steps so far`;
        canvas.dataset.progress = step;
        await new Promise((next) => setTimeout(next));
        last = performance.now();
    };
}

// Returns the function that shows the steps of a trace after the step `from`.
function played(from, drawn, camera, side) {
    const stride = Math.max(1, Math.round((presentSurvey() ? counted.last : 1) / PLAYED));
    return async (states, step) => {
        if (step <= from || (step - from) % stride || !playing) return;
        paint(states, drawn, camera, side);
        chosen.most = step;
        steps();
        await new Promise((next) => requestAnimationFrame(next));
    };
}

// The time of pictures, to choose a picture's size while the camera turns ----------

const costs = new Map();
function costKey(name) {
    return `${chosen.method.name} ${name} ${chosen.most}`;
}

function quick() {
    const names = chosen.method.schedules.loop ? [chosen.schedule, "loop"] : [chosen.schedule];
    for (const name of new Set(names)) {
        const known = costs.get(costKey(name)) || (name === "loop" ? {side: 64, took: ANSWER} : null);
        const side = known && SIDES.find((size) => size <= chosen.side
                                         && known.took * (size / known.side) ** 2 <= ANSWER);
        if (side) return {name, side};
    }
    return {name: names[names.length - 1], side: SIDES[SIDES.length - 1]};
}

// Returns the name of the unit in which a state's field `steps` counts. A packet's field counts only visits and tests.
// The slider also counts the turns (passes.js) in which a packet pushes, pops or leaves a leaf.
const stepNoun = (drawn) => drawn.packets ? "visits and tests" : "steps";

// The counts of a whole search ------------------------------------------------------------------------------

const countKey = (camera, side) => `${chosen.method.name} ${chosen.schedule} ${side} ${camera.eye}`;

// The result of `survey` for the chosen trace; null if another trace was counted last.
function presentSurvey() {
    return counted && counted.key === countKey(chosen.camera, chosen.side) ? counted : null;
}

function count(drawn, found, lives, camera, side) {
    counted = {...survey(drawn, found.states, lives), key: countKey(camera, side)};
    // With several cycles, a turn (passes.js) runs one kernel, only for the rays that wait for it. So the number of
    // turns is not a ray's number of steps.
    if (drawn.cycles.length > 1) Object.assign(counted, {last: found.turns, alive: null});
    element("pass").max = counted.last;
    if (chosen.scale === null) rescale(counted.percentile);
    steps();
}

// Shows the present step in the slider, the chart, the view of space and the program.
function steps() {
    const slider = element("pass"), found = presentSurvey();
    slider.value = chosen.most === null ? slider.max : chosen.most;
    element("step").textContent = found ? `${slider.value} of ${slider.max}` : chosen.most === null ? "" : chosen.most;
    const end = rayEnd();
    element("end").disabled = end === null;
    drawAlive(schedule().repeats ? found : null, chosen.most === null ? Infinity : chosen.most, end);
    spaceAt();
}

// Returns the step after which the clicked ray has ended; null if this step is unknown. Under kernels, a step of the
// slider runs one kernel, only for the rays that wait for it. So the slider does not count the ray's steps.
function rayEnd() {
    return path && path.states && schedule().cycles.length === 1 ? path.states.length - 1 : null;
}

function rescale(scale) {
    chosen.scale = scale;
    element("scale").value = scale;
    nameLegends(schedule().repeats ? schedule().structure.kernels : [], scale || 1);
}

// The clicked ray -----------------------------------------------------------------------------------------

async function follow() {
    if (!chosen.ray) {
        path = null;
        element("mark").hidden = true;
        element("ray").textContent = "";
        return steps();
    }
    const {side, camera} = result, {method} = chosen;
    const [x, y] = chosen.ray.map((at) => Math.max(0, Math.min(side - 1, Math.floor(at * side))));
    const key = [method.name, side, x, y, camera.eye].join(" ");
    if (!path || path.key !== key) {
        const direction = readTexture(result.directions, 1, 1, x, y);
        path = {key, states: await pathOf(method, camera, direction), direction, origin: camera.eye};
    }
    markPixel(x, y, side);
    describe(x, y);
    steps();
}

// Draws the ray in space at the present step, and marks the next kernel.
function spaceAt() {
    const whole = chosen.most === null || schedule().cycles.length !== 1, step = whole ? Infinity : chosen.most;
    const states = path && path.states;
    if (!path) {
        drawSpace(null, null, 0);
        element("space-text").textContent = chosen.ray ? "The ray is being traced."
            : "Click a pixel of the picture to follow its ray.";
        return markKernel("", true);
    }
    const {origin, direction, hit} = path, {lo, hi} = page.wires;
    const far = Math.hypot(...origin.map((x, k) => Math.max(Math.abs(x - lo[k]), Math.abs(x - hi[k]))));
    const hits = hit && hit[3] !== NO_TRIANGLE;
    drawSpace({origin, direction: [...direction.slice(0, 3)], hits,
               end: hits ? hit[0] : far / Math.hypot(...direction.slice(0, 3))}, states, step);
    element("space-text").textContent = states ? stepLine(states, step, schedule().structure)
        : `The page shows the ray without a path: ${chosen.method.no_path || chosen.method.missing.join("; ")}.`;
    markKernel(states ? states[Math.min(step, states.length - 1)].kernel : "", !playing);
}

function describe(x, y) {
    const hit = readTexture(result.hit, 1, 1, x, y), drawn = result.schedule;
    path.hit = hit;
    const lines = [`ray (${x}, ${y})`, hit[3] === NO_TRIANGLE ? "no hit"
        : `triangle ${hit[3]} at t = ${hit[0]}, u = ${hit[1]}, v = ${hit[2]}`];
    const texels = new Map();
    for (const [name, texel, swizzle] of drawn.state) {
        // A packet has one state for several rays, so scale the position to the states' texture.
        const place = sizeOf.get(result.states[texel]).map((size, k) => Math.floor([x, y][k] * size / result.side));
        if (!texels.has(texel)) texels.set(texel, readTexture(result.states[texel], 1, 1, ...place));
        lines.push(`${name} = ${[...swizzle].map((letter) => texels.get(texel)["xyzw".indexOf(letter)]).join(", ")}`);
    }
    element("ray").textContent = lines.join("\n");
}

// Choices -------------------------------------------------------------------------------------------------

// Chooses the page's selected method, the schedule `name`, and the picture's step `most` (null: the whole search). A
// method with a single schedule leaves `chosen.asked` as it is, so that the reader's choice holds for the next method.
function choose(name, most) {
    chosen.method = page.methods.find(({name}) => name === element("method").value);
    const names = Object.keys(chosen.method.schedules), list = element("schedule");
    if (list.dataset.owner !== chosen.method.name) {
        list.replaceChildren(...names.map((one) => new Option(one, one)));
        list.dataset.owner = chosen.method.name;
    }
    if (names.length > 1) chosen.asked = name;
    chosen.schedule = list.value = [name, ...OPENS].find((one) => names.includes(one));
    chosen.most = most;
    chosen.heat = element("heat").checked;
    for (const id of ["pass", "play", "heat", "scale", "percentile"]) element(id).disabled = !schedule().repeats;
    element("steps").hidden = !schedule().repeats;
    element("pass").max = Math.max(chosen.most || 1, presentSurvey() ? counted.last
        : chosen.method.costs.steps[1]);
    element("summary").textContent = `${chosen.method.citation}: ${chosen.method.summary}.`;
    element("about").replaceChildren(...paragraphs(chosen.method.about));
    element("fields").hidden = !schedule().repeats;
    element("fields").lastChild.replaceChildren(...paragraphs(schedule().meaning));
    const passes = schedule().passes, listed = element("kernel");
    const first = schedule().repeats ? kernelPass(schedule()) : 1;
    const distinct = passes.map((pass, k) => [pass, k]).filter(
        ([{fragment}], k) => passes.findIndex((one) => one.fragment === fragment) === k);
    listed.replaceChildren(...distinct.map(([{title}, k]) => new Option(title, k)));
    listed.value = distinct.find(([{fragment}]) => fragment === passes[first].fragment)[1];
    rescale(chosen.scale);
    showProgram();
    steps();
    return show();
}

// Returns the number of the first pass of the first turn whose program defines a kernel; without such a pass, the
// number of the turn's first pass.
function kernelPass({cycles, passes, structure: {kernels}}) {
    const turn = cycles[0].turns[0].passes;
    const defines = (number) => marked(page.texts[passes[number].fragment].split("\n"), kernels).some(
        (part) => typeof part !== "string");
    return turn.find(defines) ?? turn[0];
}

// Returns an element for each text. Words between backticks become code.
function paragraphs(texts) {
    return texts.map((text) => {
        const paragraph = document.createElement("p");
        paragraph.append(...text.replaceAll("``", "`").split("`").map((part, k) => {
            const one = document.createElement(k % 2 ? "code" : "span");
            one.textContent = part;
            return one;
        }));
        return paragraph;
    });
}

function showProgram() {
    const drawn = schedule(), number = Number(element("kernel").value);
    showText(page.texts[drawn.passes[number].fragment], drawn.structure.kernels);
}

// Returns the sine of the angle between a view and the camera's upward direction.
function slant(eye, {target: at, up}) {
    return Math.hypot(...cross(unit(eye.map((x, k) => x - at[k])), unit(up)));
}

// Returns whether the view from `eye` is far enough from the upward direction. The sine of the angle between them must
// be at least 0.1, or at least the sine for `camera` (with a margin for rounding).
function sideways(eye, camera) {
    return slant(eye, camera) >= Math.min(0.1, slant(camera.eye, camera) * (1 - 1e-6));
}

// Keeps the choices after the "#" of the address, for links.
function remember() {
    const choices = new URLSearchParams({method: chosen.method.name, schedule: chosen.schedule,
                                         rays: element("size").value});
    if (chosen.most !== null) choices.set("pass", chosen.most);     // also under `loop`, for the next method
    if (chosen.heat) choices.set("heat", chosen.scale || 1);
    if (chosen.ray) choices.set("ray", chosen.ray.map((at) => Number(at.toFixed(4))).join(","));
    const {camera} = chosen;
    if (camera !== page.camera) choices.set("eye", camera.eye.map((x) => Number(x.toPrecision(6))).join(","));
    try {
        history.replaceState(null, "", `#${String(choices).replaceAll("%2C", ",")}`);
    } catch {
        // A browser may limit how often the address changes. The next picture tries again.
    }
}

// Part of the address -> a function that says whether a text is valid there.
const UNDERSTOOD = {
    method: (text) => runnable.some(({name}) => name === text),
    schedule: (text, method) => Object.hasOwn(method.schedules, text),
    rays: (text) => [...element("size").options].some(({value}) => value === text),
    pass: (text) => Number(text) >= 1,
    heat: (text) => text === "" || Number(text) >= 1 && Number.isFinite(Number(text)),
    ray: (text) => isList(text, 2, (at) => at >= 0 && at <= 1),
    eye: (text) => isList(text, 3, Number.isFinite) && sideways(text.split(",").map(Number), page.camera),
};

// Returns whether a text has `length` numbers, separated by commas, and `holds` is true for each number.
function isList(text, length, holds) {
    const parts = text.split(",");
    return parts.length === length && parts.every((part) => part.trim() !== "" && holds(Number(part)));
}

// Names the parts of the address that the page cannot follow, in a line of plain text.
function sayUnread() {
    const choices = [...new URLSearchParams(location.hash.slice(1))];
    const named = (choices.find(([name]) => name === "method") || [])[1];
    const method = runnable.find(({name}) => name === named) || opening;
    const only = {method: `the page runs only ${runnable.map(({name}) => name).join(", ")}`,
                  schedule: `${method.name} has only ${Object.keys(method.schedules).join(", ")}`};
    const unread = choices.filter(([name, text]) => !Object.hasOwn(UNDERSTOOD, name) || !UNDERSTOOD[name](text, method))
        .map(([name, text]) => {
            const part = `${name}=${text}`, cut = part.length > 60 ? `${part.slice(0, 60)}...` : part;
            return Object.hasOwn(only, name) ? `${cut} (${only[name]})` : cut;
        });
    element("unread").textContent = unread.length ? `The page cannot follow these parts of its address: ${
        unread.join("; ")}` : "";
}

// Reads the choices from the page's address. Returns the schedule's name and the step (null for the whole search). By
// default, the page opens in mid-search, with the ray that takes the most steps.
function recall() {
    sayUnread();
    const choices = new URLSearchParams(location.hash.slice(1));
    const numbers = (name) => (choices.get(name) || "").split(",").map(Number);
    const among = (list, value, otherwise) => [...list.options].some((one) => one.value === value) ? value : otherwise;
    element("method").value = among(element("method"), choices.get("method"), opening.name);
    element("size").value = among(element("size"), choices.get("rays"), String(opening.test.side));
    chosen.side = Number(element("size").value);
    const [ray, eye, pass, scale] = ["ray", "eye", "pass", "heat"].map(numbers);
    element("heat").checked = choices.has("heat");
    const understood = (name) => choices.has(name) && UNDERSTOOD[name](choices.get(name));
    if (choices.get("heat") && understood("heat")) chosen.scale = scale[0];
    chosen.ray = understood("ray") ? ray : null;
    chosen.camera = understood("eye") ? {...page.camera, eye} : page.camera;
    if (!["schedule", "pass", "ray"].some((name) => choices.has(name))) {
        const {costs, test, schedules} = runnable.find(({name}) => name === element("method").value);
        // `costs.ray` is the place of the test ray with the most steps. The test rays have `test.side` and the scene's
        // camera. In any other picture, another ray goes through this place.
        chosen.ray = chosen.side === test.side && chosen.camera === page.camera ? costs.ray : null;
        return [OPENS[0], schedules.step ? costs.step : null];
    }
    return [choices.get("schedule") || OPENS[0], pass[0] >= 1 ? Math.min(Math.floor(pass[0]), MOST_TURNS) : null];
}
