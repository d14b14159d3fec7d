// The player of a page: draws the passes that the description names, in WebGL 2. It knows no traversal method.
"use strict";

const page = JSON.parse(document.getElementById("description").textContent);
const canvas = document.getElementById("picture");
const gl = canvas.getContext("webgl2", {antialias: false, preserveDrawingBuffer: true});
const element = (id) => document.getElementById(id);
const NO_TRIANGLE = 16777216;
const UNWRITTEN = -2;      // what a target holds where no fragment wrote
const SLICE = 30;           // milliseconds of passes between two pauses for the page's events
const CHECKED = 16;         // passes between two looks at whether rays are alive
const MOST_PASSES = 60000;  // a search that takes more passes is stopped

// A lost context fails in many places. Its own events tell the reader, so that no other message is needed.
function fail(message) {
    if (gl && gl.isContextLost()) throw new Error("The context is lost.");
    element("message").textContent = message;
    element("verdict").textContent = "The test ended early, so nothing is known about this graphics card.";
    const test = element("selftest");
    test.dataset.state = "failed";
    throw new Error(message);
}
if (!gl) fail("This browser offers no WebGL 2.");
function enableFloats() {
    if (!gl.getExtension("EXT_color_buffer_float")) fail("This graphics card cannot draw into float textures.");
}
enableFloats();

async function floats(base64) {
    const text = atob(base64), bytes = new Uint8Array(text.length);
    for (let k = 0; k < text.length; ++k) bytes[k] = text.charCodeAt(k);
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Float32Array(await new Response(stream).arrayBuffer());
}

// Textures, targets and programs --------------------------------------------------------------------------

function texture(width, height, components, values) {
    const limit = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    if (Math.max(width, height) > limit) {
        fail(`A texture of ${width} x ${height} texels is larger than this graphics card holds (${limit} x ${limit}). `
             + "Take fewer rays, or a page of a smaller scene.");
    }
    const made = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, made);
    const [internal, format] = components === 1 ? [gl.R32F, gl.RED] : [gl.RGBA32F, gl.RGBA];
    gl.texImage2D(gl.TEXTURE_2D, 0, internal, width, height, 0, format, gl.FLOAT, values);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
        gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
    }
    for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) {
        gl.texParameteri(gl.TEXTURE_2D, wrap, gl.CLAMP_TO_EDGE);
    }
    return made;
}

const tables = new Map();
async function table(number) {
    if (!tables.has(number)) {
        const {size, components, data} = page.tables[number];
        tables.set(number, texture(size[0], size[1], components, await floats(data)));
    }
    return tables.get(number);
}

const targets = new Map();
function target(name, width, height, count) {
    const key = `${name} ${width} ${height} ${count}`;
    if (!targets.has(key)) {
        const textures = Array.from({length: count}, () => texture(width, height, 4, null));
        const framebuffer = gl.createFramebuffer();
        gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
        textures.forEach((one, k) => gl.framebufferTexture2D(
            gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + k, gl.TEXTURE_2D, one, 0));
        gl.drawBuffers(textures.map((_, k) => gl.COLOR_ATTACHMENT0 + k));
        targets.set(key, {framebuffer, textures, width, height});
    }
    return targets.get(key);
}

// Frees the targets of a place, except the targets for pictures of `side` x `side` rays.
function freeTargets(place, side = 0) {
    for (const [key, {framebuffer, textures, width}] of targets) {
        if (!key.startsWith(`${place} `) || side && [side, Math.ceil(side / 16)].includes(width)) continue;
        gl.deleteFramebuffer(framebuffer);
        textures.forEach((one) => gl.deleteTexture(one));
        targets.delete(key);
    }
}

const programs = new Map();
function program(vertex, fragment) {
    const key = `${vertex} ${fragment}`;
    if (!programs.has(key)) {
        const made = gl.createProgram();
        for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
            const shader = gl.createShader(kind);
            gl.shaderSource(shader, page.texts[text]);
            gl.compileShader(shader);
            if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) fail(gl.getShaderInfoLog(shader));
            gl.attachShader(made, shader);
        }
        gl.bindAttribLocation(made, 0, "rectangle");
        gl.linkProgram(made);
        if (!gl.getProgramParameter(made, gl.LINK_STATUS)) fail(gl.getProgramInfoLog(made));
        const uniforms = new Map();
        for (let k = 0; k < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); ++k) {
            const {name, type} = gl.getActiveUniform(made, k);
            // An array is named after its first element.
            uniforms.set(name.replace("[0]", ""), {type, place: gl.getUniformLocation(made, name)});
        }
        programs.set(key, {made, uniforms});
    }
    return programs.get(key);
}

const INTEGERS = new Map([[gl.INT, 1], [gl.BOOL, 1], [gl.INT_VEC2, 2], [gl.INT_VEC3, 3], [gl.INT_VEC4, 4]]);
function setUniform({type, place}, values) {
    const list = [values].flat();
    if (INTEGERS.has(type)) gl[`uniform${INTEGERS.get(type)}iv`](place, list.map(Number));
    else gl[`uniform${list.length}fv`](place, list);
}

function draw(vertex, fragment, into, uniforms, inputs) {
    const {made, uniforms: known} = program(vertex, fragment);
    gl.useProgram(made);
    gl.bindFramebuffer(gl.FRAMEBUFFER, into.framebuffer);
    gl.viewport(0, 0, into.width, into.height);
    const all = {scale: [2 / into.width, 2 / into.height], depth: 0, ...uniforms};
    for (const [name, values] of Object.entries(all)) if (known.has(name)) setUniform(known.get(name), values);
    Object.entries(inputs).forEach(([name, one], unit) => {
        gl.activeTexture(gl.TEXTURE0 + unit);
        gl.bindTexture(gl.TEXTURE_2D, one);
        if (known.has(name)) gl.uniform1i(known.get(name).place, unit);
    });
    gl.vertexAttrib4f(0, 0, 0, 2 * into.width, 2 * into.height);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
}

// Tracing -------------------------------------------------------------------------------------------------

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const scaled = (a, factor) => a.map((x) => x * factor);
const unit = (a) => scaled(a, 1 / Math.hypot(...a));

function basis({eye, target: at, up, fov}, width, height) {
    const forward = unit(at.map((x, k) => x - eye[k]));
    const right = unit(cross(forward, up));
    const half = Math.tan(fov * Math.PI / 360);
    return {eye, forward, right: scaled(right, half * width / height), up: scaled(cross(right, forward), half),
            size: [width, height]};
}

// Draws the passes of a schedule. Returns the directions, the last states and hit, and the number of passes.
// With `directions`, a texture, the rays are not the camera's. `most` ends a repeated pass early.
// `place` names the targets, so that two traces at a time share none; `stopped` ends the trace early.
// `seen` receives the states after each pass, and the number of passes since the set-up of states.
async function trace(schedule, camera, width, height,
                     {directions = null, most = MOST_PASSES, place = "picture", stopped = () => false,
                      seen = null} = {}) {
    let since = performance.now();
    let rays = [null, directions], previous = [], passes = 0, alive = 0, steps = 0;
    for (const [number, pass] of schedule.passes.entries()) {
        if (number === 0) {
            if (directions) continue;
            const into = target(`${place} rays`, width, height, pass.outputs);
            draw(pass.vertex, pass.fragment, into, {...pass.uniforms, ...basis(camera, width, height)}, {});
            rays = into.textures;
            continue;
        }
        const last = schedule.repeats && number === schedule.passes.length - 1;
        const bound = {};
        for (const [sampler, source] of Object.entries(pass.inputs)) {
            if (source.startsWith("table:")) bound[sampler] = await table(Number(source.slice(6)));
        }
        const uniforms = {...pass.uniforms, rays_texel_0: [...camera.eye, 0]};
        for (let turn = 0; turn < (last ? most : 1); ++turn) {
            for (const [sampler, source] of Object.entries(pass.inputs)) {
                const [group, k] = source.split(":");
                if (group !== "table") bound[sampler] = (group === "rays" ? rays : previous)[Number(k)];
            }
            const into = target(`${place} states ${(number + turn) % 2}`, width, height, pass.outputs);
            gl.bindFramebuffer(gl.FRAMEBUFFER, into.framebuffer);
            into.textures.forEach((_, k) => gl.clearBufferfv(gl.COLOR, k, [0, 1, 2, 3].map(() => UNWRITTEN)));
            draw(pass.vertex, pass.fragment, into, uniforms, bound);
            previous = into.textures;
            passes += 1;
            if (seen) {
                await seen({directions: rays[1], states: previous, hit: previous[schedule.hit],
                            framebuffer: into.framebuffer}, passes - 1);
                if (last && stopped()) break;
            }
            if (last && (turn + 1) % CHECKED === 0) {
                [alive, steps] = look(schedule, previous, width, height, place);
                if (alive === 0 || stopped()) break;
                if (performance.now() - since > SLICE) {
                    await new Promise((next) => setTimeout(next));
                    since = performance.now();
                }
            }
        }
    }
    if (schedule.repeats) [alive, steps] = look(schedule, previous, width, height, place);
    return {directions: rays[1], states: previous, hit: previous[schedule.hit], passes, alive, steps};
}

function field(schedule, name) {
    const [, texel, swizzle] = schedule.state.find(([known]) => known === name);
    return [texel, "xyzw".indexOf(swizzle)];
}

function look(schedule, states, width, height, place) {
    const [[phase, a], [steps, b]] = [field(schedule, "phase"), field(schedule, "steps")];
    const into = target(`${place} alive`, Math.ceil(width / 16), Math.ceil(height / 16), 1);
    draw(page.whole, page.alive, into, {places: [a, b]}, {phases: states[phase], counts: states[steps]});
    const found = read(into);
    let alive = 0, most = 0;
    for (let k = 0; k < found.length; k += 4) {
        alive += found[k];
        most = Math.max(most, found[k + 1]);
    }
    return [alive, most];
}

function read({framebuffer, width, height}, x = 0, y = 0) {
    const values = new Float32Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.readBuffer(gl.COLOR_ATTACHMENT0);
    gl.readPixels(x, y, width, height, gl.RGBA, gl.FLOAT, values);
    return values;
}

function readTexture(one, width, height, x = 0, y = 0) {
    const framebuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, one, 0);
    const values = read({framebuffer, width, height}, x, y);
    gl.deleteFramebuffer(framebuffer);
    return values;
}

// The self-test: known rays, whose hits must be the same to the bit ----------------------------------------

// `idle` waits while the reader's own picture is traced. `lost` says that the context was lost meanwhile.
async function selfTest(idle, lost) {
    const report = element("selftest");
    report.replaceChildren();
    report.dataset.state = "running";
    let rays = 0, differing = 0;
    for (const method of page.methods) {
        const {side, eye} = method.test;
        const given = await floats(method.test.directions), right = await floats(method.test.hits);
        const bits = new Uint32Array(right.buffer), directions = texture(side, side, 4, given);
        let wrong = 0, traced = 0;
        for (const schedule of Object.values(method.schedules)) {
            const {hit} = await trace(schedule, {eye}, side, side,
                                      {directions, place: "test", seen: idle, stopped: lost});
            if (lost()) return;
            const found = readTexture(hit, side, side), foundBits = new Uint32Array(found.buffer);
            for (let k = 0; k < found.length; k += 4) {
                const hits = found[k + 3] !== NO_TRIANGLE;
                const same = hits ? right[k + 3] === found[k + 3] && [0, 1, 2].every(
                    (i) => bits[k + i] === foundBits[k + i]) : right[k + 3] < 0;
                wrong += same ? 0 : 1;
            }
            traced += found.length / 4;
        }
        gl.deleteTexture(directions);
        freeTargets("test");
        const line = document.createElement("span");
        line.className = "method";
        Object.assign(line.dataset, {method: method.name, rays: traced, differing: wrong});
        line.textContent = `${method.name}: ${wrong === 0 ? "exact" : `${wrong} of ${traced} differ`}`;
        report.append(line);
        rays += traced;
        differing += wrong;
    }
    Object.assign(report.dataset, {state: "done", rays, differing});
    element("verdict").textContent = differing === 0
        ? `All ${rays.toLocaleString("en")} test rays have the known hits, to the bit.`
        : `${differing.toLocaleString("en")} of ${rays.toLocaleString("en")} test rays differ from the known `
          + "hits on this graphics card, so its pictures are not exact.";
}
