// The player of a page. It draws the passes that the description names, in WebGL 2, for any method.

const page = JSON.parse(document.getElementById("description").textContent);
const canvas = document.getElementById("picture");
const gl = canvas.getContext("webgl2", {antialias: false, preserveDrawingBuffer: true});
const element = (id) => document.getElementById(id);
const {NO_TRIANGLE, TILE} = page.constants;   // TILE: side in rays of the squares that are drawn or skipped
const UNWRITTEN = -2;      // value of a target's texels before any fragment is written
const SLICE = 30;           // milliseconds of passes between two pauses for the page's events

// Thrown when the WebGL context is lost. A listener (start.js) already tells the reader, so code that catches this
// error shows no message.
class LostContext extends Error {}
let losses = 0;             // how often the context was lost

// Returns a function that throws a LostContext if the context was lost since `watched` was called. Asynchronous work
// calls the function after each pause: after a loss, textures are gone, even if the context was restored meanwhile.
function watched() {
    const before = losses;
    return () => {
        if (losses !== before || gl.isContextLost()) throw new LostContext();
    };
}

// Tells the reader what failed. A self-test that has ended keeps its verdict.
function fail(message) {
    if (gl && gl.isContextLost()) throw new LostContext();
    element("message").textContent = message;
    const test = element("selftest");
    if (test.dataset.state === "running") {
        element("verdict").textContent = "The test ended early, so nothing is known about this graphics card.";
        test.dataset.state = "failed";
    }
    throw new Error(message);
}
if (!gl) fail("This browser offers no WebGL 2.");
let parallel = null;        // the extension that says whether a program is compiled

function enableExtensions() {
    parallel = gl.getExtension("KHR_parallel_shader_compile");
    if (!gl.getExtension("EXT_color_buffer_float")) fail("This graphics card cannot draw into float textures.");
}
enableExtensions();

// Textures, targets and programs --------------------------------------------------------------------------

const sizeOf = new WeakMap();       // texture -> [width, height]

function texture(width, height, components, values) {
    const limit = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    if (Math.max(width, height) > limit) {
        fail(`A texture of ${width} x ${height} texels is larger than this graphics card holds (${limit} x ${limit}). `
             + "Choose fewer rays, or a page of a smaller scene.");
    }
    const made = gl.createTexture();
    sizeOf.set(made, [width, height]);
    gl.bindTexture(gl.TEXTURE_2D, made);
    const [internal, format] = {1: [gl.R32F, gl.RED], 2: [gl.RG32F, gl.RG], 4: [gl.RGBA32F, gl.RGBA]}[components];
    gl.texImage2D(gl.TEXTURE_2D, 0, internal, width, height, 0, format, gl.FLOAT, values);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
        gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
    }
    for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) {
        gl.texParameteri(gl.TEXTURE_2D, wrap, gl.CLAMP_TO_EDGE);
    }
    return made;
}

const values = (number) => unpacked(page.tables[number]);

// Table number -> promise of the table's texture. Passes share these textures.
const tables = new Map();
function table(number) {
    return cached(tables, number, tableTexture);
}

// Returns the value under a key of the map `made`. `make` makes it at first use.
function cached(made, key, make) {
    if (!made.has(key)) made.set(key, make(key));
    return made.get(key);
}

async function tableTexture(number) {
    const {size: [width, height, components], triangles} = page.tables[number], check = watched();
    const found = await values(number), texels = triangles ? await triangleTable(found, 4 * width * height) : found;
    check();
    return texture(width, height, components, texels);
}

// The promise of the corners of the scene's triangles, nine numbers per triangle.
let corners = null;
function sceneCorners() {
    return corners ??= expandedCorners();
}

async function expandedCorners() {
    const [vertices, numbers] = [await values(page.triangles.vertices), await values(page.triangles.corners)];
    const expanded = new Float32Array(3 * numbers.length);
    numbers.forEach((number, k) => expanded.set(vertices.subarray(3 * number, 3 * number + 3), 3 * k));
    return expanded;
}

// Returns a triangle table, three texels per triangle: v0 and the triangle's number; v1 and whether the triangle
// is the last of its leaf; v2.
async function triangleTable(rows, length) {
    const from = await sceneCorners(), texels = new Float32Array(length);
    for (let row = 0; row < rows.length / 2; ++row) {
        const [triangle, last] = [rows[2 * row], rows[2 * row + 1]], at = 12 * row;
        for (let k = 0; k < 9; ++k) texels[at + k + Math.floor(k / 3)] = from[9 * triangle + k];
        texels[at + 3] = triangle;
        texels[at + 7] = last;
    }
    return texels;
}

// Returns the texture of the triangles' normals and colours.
async function surfaceTexture() {
    const width = 1024, check = watched();
    const from = await sceneCorners(), colours = await values(page.triangles.colours);
    check();
    const height = Math.ceil(colours.length / width), texels = new Float32Array(4 * width * height);
    colours.forEach((colour, triangle) => {
        const [a, b, c] = [0, 3, 6].map((k) => Array.from(from.subarray(9 * triangle + k, 9 * triangle + k + 3)));
        const normal = cross(b.map((x, k) => x - a[k]), c.map((x, k) => x - a[k]));
        const length = Math.max(Math.hypot(...normal), 1e-300);
        texels.set([...scaled(normal, 1 / length), colour], 4 * triangle);
    });
    return texture(width, height, 4, texels);
}

const MOST_OUTPUTS = Math.min(...[gl.MAX_DRAW_BUFFERS, gl.MAX_COLOR_ATTACHMENTS].map((one) => gl.getParameter(one)));
for (const method of page.methods) {
    method.missing = Object.entries(method.schedules).filter(([, {outputs}]) => outputs > MOST_OUTPUTS).map(
        ([name, {outputs}]) => `${name} needs ${outputs} render targets, and this card has ${MOST_OUTPUTS}`);
    method.schedules = Object.fromEntries(Object.entries(method.schedules).filter(
        ([, {outputs}]) => outputs <= MOST_OUTPUTS));
}
const runnable = page.methods.filter(({schedules}) => Object.keys(schedules).length);
if (!runnable.length) fail(`No method of this page runs here: ${page.methods[0].missing.join("; ")}.`);

const targets = new Map();

// Returns the render target named `place`, such as "picture 0", for `width` x `height` rays. `of` is the size of a
// tile in texels per ray. With several `levels`, the target is an atlas with a tile for each level.
function target(place, {of = [1, 1], outputs, components = 4, levels = 1}, width, height) {
    const key = JSON.stringify([place, of, outputs, components, levels, width, height]);
    if (!targets.has(key)) {
        const tile = [Math.ceil(of[0] * width), Math.ceil(of[1] * height)];
        const widest = gl.getParameter(gl.MAX_TEXTURE_SIZE);
        const across = Math.max(1, Math.min(levels, Math.floor(widest / tile[0])));
        const size = [tile[0] * across, tile[1] * Math.ceil(levels / across)];
        const textures = Array.from({length: outputs}, () => texture(...size, components, null));
        const framebuffer = gl.createFramebuffer();
        gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
        textures.forEach((one, k) => gl.framebufferTexture2D(
            gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + k, gl.TEXTURE_2D, one, 0));
        gl.drawBuffers(textures.map((_, k) => gl.COLOR_ATTACHMENT0 + k));
        targets.set(key, {framebuffer, textures, width: size[0], height: size[1], tile, across, levels});
    }
    targets.get(key).stamp = stamps.get(place.split(" ")[0]);
    return targets.get(key);
}

const stamps = new Map();       // first word of targets' names -> the number of traces that drew into them

// Frees the targets whose names begin with the word `place`. With `keepsLast`, keeps the targets of the last trace.
function freeTargets(place, keepsLast = false) {
    for (const [key, {framebuffer, textures, stamp}] of targets) {
        if (!key.startsWith(`["${place} `) || keepsLast && stamp === stamps.get(place)) continue;
        gl.deleteFramebuffer(framebuffer);
        textures.forEach((one) => gl.deleteTexture(one));
        targets.delete(key);
    }
}

const programs = new Map();

// Starts the compilation of a program.
function started(vertex, fragment) {
    const key = `${vertex} ${fragment}`;
    if (!programs.has(key)) {
        const made = gl.createProgram();
        const shaders = [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]].map(([kind, text]) => {
            const shader = gl.createShader(kind);
            gl.shaderSource(shader, page.texts[text]);
            gl.compileShader(shader);
            gl.attachShader(made, shader);
            return shader;
        });
        gl.bindAttribLocation(made, 0, "rectangle");
        gl.linkProgram(made);
        programs.set(key, {made, shaders, uniforms: null});
    }
    return programs.get(key);
}

// Waits until the programs of the passes are compiled.
async function compiled(passes) {
    for (const {made} of passes.map(({vertex, fragment}) => started(vertex, fragment))) {
        while (parallel && !gl.getProgramParameter(made, parallel.COMPLETION_STATUS_KHR) && !gl.isContextLost()) {
            await new Promise((next) => setTimeout(next, 5));
        }
    }
}

function program(vertex, fragment) {
    const found = started(vertex, fragment), {made, shaders} = found;
    if (!found.uniforms) {
        if (!gl.getProgramParameter(made, gl.LINK_STATUS)) {
            const logs = [...shaders.map((one) => gl.getShaderInfoLog(one)), gl.getProgramInfoLog(made)];
            fail(logs.filter((log) => log).join(" "));
        }
        found.uniforms = new Map();
        for (let k = 0; k < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); ++k) {
            const {name, type} = gl.getActiveUniform(made, k);
            // WebGL names an array by its first element, "name[0]".
            found.uniforms.set(name.replace("[0]", ""), {type, place: gl.getUniformLocation(made, name)});
        }
    }
    return found;
}

const SETTERS = new Map([
    [gl.INT, "1iv"], [gl.BOOL, "1iv"], [gl.INT_VEC2, "2iv"], [gl.INT_VEC3, "3iv"], [gl.INT_VEC4, "4iv"],
    [gl.FLOAT, "1fv"], [gl.FLOAT_VEC2, "2fv"], [gl.FLOAT_VEC3, "3fv"], [gl.FLOAT_VEC4, "4fv"]]);
function setUniform({type, place}, values) {
    gl[`uniform${SETTERS.get(type)}`](place, [values].flat().map(Number));
}

let rectangleBuffer = null;

// Draws a pass on rectangles (left, top, right, bottom, in units of `unit` texels; null: on the whole target).
function draw(vertex, fragment, into, uniforms, inputs, rectangles = null, unit = 1) {
    const {made, uniforms: known} = program(vertex, fragment);
    gl.useProgram(made);
    gl.bindFramebuffer(gl.FRAMEBUFFER, into.framebuffer);
    gl.viewport(0, 0, into.width, into.height);
    const all = {scale: [2 * unit / into.width, 2 * unit / into.height], depth: 0, ...uniforms};
    for (const [name, values] of Object.entries(all)) if (known.has(name)) setUniform(known.get(name), values);
    Object.entries(inputs).forEach(([name, one], place) => {
        gl.activeTexture(gl.TEXTURE0 + place);
        gl.bindTexture(gl.TEXTURE_2D, one);
        if (known.has(name)) gl.uniform1i(known.get(name).place, place);
    });
    if (rectangles === null) {
        gl.disableVertexAttribArray(0);
        gl.vertexAttrib4f(0, 0, 0, 2 * into.width / unit, 2 * into.height / unit);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
    } else {
        if (!gl.isBuffer(rectangleBuffer)) rectangleBuffer = gl.createBuffer();     // again after a lost context
        gl.bindBuffer(gl.ARRAY_BUFFER, rectangleBuffer);
        gl.bufferData(gl.ARRAY_BUFFER, rectangles, gl.STREAM_DRAW);
        gl.enableVertexAttribArray(0);
        gl.vertexAttribPointer(0, 4, gl.FLOAT, false, 0, 0);
        gl.vertexAttribDivisor(0, 1);
        gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, rectangles.length / 4);
    }
}
function read({framebuffer, width, height}, output = 0, x = 0, y = 0) {
    const values = new Float32Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.readBuffer(gl.COLOR_ATTACHMENT0 + output);
    gl.readPixels(x, y, width, height, gl.RGBA, gl.FLOAT, values);
    return values;
}

function readTexture(one, width, height, x = 0, y = 0) {
    const framebuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, one, 0);
    const values = read({framebuffer, width, height}, 0, x, y);
    gl.deleteFramebuffer(framebuffer);
    return values;
}
