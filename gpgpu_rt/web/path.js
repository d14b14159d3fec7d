// The path of a single ray, read from the states that the passes write. Here is no traversal: the ray is traced by the
// method's own passes, its states are kept, and their fields name the node or the cell, and the triangle under test.

const ROW = 1024;           // states in a row of the texture that keeps them
const MOST_STATES = 8192;   // a longer path is cut off

// The values of tables, read back from the textures that the passes sample.
const tableValues = new Map();
async function valuesOf(number) {
    if (!tableValues.has(number)) {
        tableValues.set(number, readTexture(await table(number), ...page.tables[number].size.slice(0, 2)));
    }
    return tableValues.get(number);
}

// Returns (record number) -> value of a field of a table: a number, or an array for a vector.
async function reader(drawn, name) {
    const [sampler, texels, texel, swizzle] = drawn.structure.places[name];
    const values = await valuesOf(Number(sourceOf(drawn, sampler).split(":")[1])), first = "xyzw".indexOf(swizzle[0]);
    return (record) => {
        const at = 4 * (record * texels + texel) + first;
        return swizzle.length === 1 ? values[at] : [...values.subarray(at, at + swizzle.length)];
    };
}

// Returns what a sampler of the passes reads, such as "table:3".
function sourceOf(drawn, sampler) {
    return drawn.passes.map(({inputs}) => inputs[sampler]).find((one) => one);
}

function uniformOf(drawn, name) {
    return drawn.passes.map(({uniforms}) => uniforms[name]).find((value) => value);
}

// Returns (state) -> [low corner, high corner] of the state's node or cell, or null.
async function boxReader(drawn) {
    const kind = drawn.structure.boxes;
    if (kind === "cells") {
        const [lo, size] = ["scene_lo", "cell_size"].map((name) => uniformOf(drawn, name));
        return ({cell}) => [0, 1].map((far) => cell.map((x, k) => lo[k] + (x + far) * size[k]));
    }
    if (kind === "boxes") {
        const [lo, hi] = [await reader(drawn, "lo"), await reader(drawn, "hi")];
        return ({node}) => node < 0 ? null : [lo(node), hi(node)];
    }
    if (kind === "planes") {
        const boxes = await splitBoxes(drawn);
        return ({node}) => boxes.get(node) || null;
    }
    return () => null;
}

// The boxes of a kd-tree's nodes, which store split planes alone: node -> [low corner, high corner].
const splitTrees = new Map();
async function splitBoxes(drawn) {
    const known = sourceOf(drawn, drawn.structure.places.split[0]);
    if (splitTrees.has(known)) return splitTrees.get(known);
    const [split, axis, left] = [await reader(drawn, "split"), await reader(drawn, "axis"),
                                 await reader(drawn, "left")];
    const boxes = new Map(), open = [[0, uniformOf(drawn, "scene_lo"), uniformOf(drawn, "scene_hi")]];
    while (open.length) {
        const [node, lo, hi] = open.pop();
        boxes.set(node, [lo, hi]);
        if (axis(node) > 2) continue;
        const cut = (corner) => corner.map((x, k) => k === axis(node) ? split(node) : x);
        open.push([left(node), lo, cut(hi)], [left(node) + 1, cut(lo), hi]);
    }
    splitTrees.set(known, boxes);
    return boxes;
}

// Returns (state) -> the corners of the triangle that the state's kernel tests next, or null.
async function triangleReader(drawn) {
    const {places} = drawn.structure;
    if (!places.v0) return () => null;
    const corners = await Promise.all(["v0", "v1", "v2"].map((name) => reader(drawn, name)));
    const list = places.triangle ? await reader(drawn, "triangle") : (cursor) => cursor;
    return ({cursor}) => list(cursor) < 0 ? null : corners.map((corner) => corner(list(cursor)));
}

// Returns the path of a ray: for the set-up and for each step, the ray's state (`fields`), the kernel that runs next,
// the box, the triangle under test and the interval on the ray. Returns null if the method has no steps, or traces packets.
async function pathOf(method, camera, direction, lost) {
    const drawn = method.schedules.step;
    if (!drawn || drawn.targets[drawn.start.states].of.some((size) => size < 1)) return null;     // a packet's state
    const {kernels, lags} = drawn.structure, count = drawn.targets[drawn.start.states].outputs;
    const rows = count * Math.ceil(MOST_STATES / ROW);
    const kept = texture(ROW, rows, 4, null), directions = texture(1, 1, 4, new Float32Array(direction));
    let length = 0;
    const keep = ({framebuffer}, step) => {
        if (step >= MOST_STATES) return;
        gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
        gl.activeTexture(gl.TEXTURE0);
        gl.bindTexture(gl.TEXTURE_2D, kept);
        for (let k = 0; k < count; ++k) {
            gl.readBuffer(gl.COLOR_ATTACHMENT0 + k);
            gl.copyTexSubImage2D(gl.TEXTURE_2D, 0, step % ROW, count * Math.floor(step / ROW) + k, 0, 0, 1, 1);
        }
        gl.readBuffer(gl.COLOR_ATTACHMENT0);
        length = step + 1;
    };
    await trace(drawn, camera, 1, 1, {directions, place: "path", seen: keep, stopped: lost});
    const values = readTexture(kept, ROW, count * Math.ceil(length / ROW));
    [kept, directions].forEach((one) => gl.deleteTexture(one));
    const [boxAt, triangleAt] = [await boxReader(drawn), await triangleReader(drawn)];
    const states = [];
    for (let step = 0; step < length; ++step) {
        const fields = {};
        for (const [name, texel, swizzle] of drawn.state) {
            const at = 4 * (ROW * (count * Math.floor(step / ROW) + texel) + step % ROW);
            const found = [...swizzle].map((letter) => values[at + "xyzw".indexOf(letter)]);
            fields[name] = found.length === 1 ? found[0] : found;
        }
        const kernel = kernels[fields.phase - 1] || "", tests = kernel === "intersect", last = states[step - 1];
        states.push({fields, kernel, interval: intervalOf(fields),
                     box: !kernel ? null : tests && lags ? last && last.box : boxAt(fields),
                     triangle: tests ? triangleAt(fields) : null});
        if (fields.phase <= 0) break;       // a ray that has ended keeps its state
    }
    return states;
}

function intervalOf({t_min: lo, t_max: hi, t_enter: enter, t_next: next}) {
    return lo !== undefined ? [lo, hi] : enter !== undefined ? [enter, Math.min(...next)] : null;
}
