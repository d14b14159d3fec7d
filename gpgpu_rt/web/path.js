// Reads the path of a single ray from the states that the method's passes write. Fields of the states name the node or
// cell, and the triangle under test. This script runs no traversal.

const ROW = 1024;           // number of states in a row of the texture that keeps a path's states
const MOST_STATES = 8192;   // a longer path is cut off

const tableValues = new Map();
function valuesOf(number) {
    return cached(tableValues, number, async () => {
        const check = watched(), found = readTexture(await table(number), ...page.tables[number].size.slice(0, 2));
        check();
        return found;
    });
}

// Returns the function (record number) -> value of the table field `name`: a number, or an array for a vector.
async function reader(drawn, name) {
    const [sampler, texels, texel, swizzle] = drawn.structure.places[name];
    const values = await valuesOf(tableOf(drawn, sampler)), first = "xyzw".indexOf(swizzle[0]);
    return (record) => {
        const at = 4 * (record * texels + texel) + first;
        return swizzle.length === 1 ? values[at] : [...values.subarray(at, at + swizzle.length)];
    };
}

// Returns the index in `page.tables` of the table behind a sampler.
function tableOf(drawn, sampler) {
    return Number(drawn.passes.map(({inputs}) => inputs[sampler]).find((one) => one).split(":")[1]);
}

function uniformOf(drawn, name) {
    return drawn.passes.map(({uniforms}) => uniforms[name]).find((value) => value);
}

// Returns the function (state) -> [low corner, high corner] of the state's node or cell, or null.
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
        const boxOf = await splitBoxes(drawn);
        return ({node}) => boxOf(node);
    }
    return () => null;
}

// Returns the function (node) -> [low corner, high corner], or null, for a kd-tree whose nodes store only split planes.
// A node's box is the scene's box, cut by the split planes of the node's ancestors.
async function splitBoxes(drawn) {
    const [split, axis] = [await reader(drawn, "split"), await reader(drawn, "axis")];
    const left = await reader(drawn, "left"), parents = await parentsOf(drawn, axis, left);
    const corners = ["scene_lo", "scene_hi"].map((name) => uniformOf(drawn, name));
    return (node) => {
        if (node !== 0 && !(parents[node] >= 0)) return null;
        const ancestors = [], [lo, hi] = corners.map((corner) => [...corner]);
        for (let at = node; at !== 0; at = parents[at]) ancestors.push([parents[at], at]);
        for (const [parent, child] of ancestors.reverse()) {
            (child === left(parent) ? hi : lo)[axis(parent)] = split(parent);
        }
        return [lo, hi];
    };
}

const splitTrees = new Map();

// Returns a promise of the parent of each node of a kd-tree. The root's parent is -1.
function parentsOf(drawn, axis, left) {
    const [sampler, texels] = drawn.structure.places.left, number = tableOf(drawn, sampler);
    return cached(splitTrees, number, async () => {
        const [width, height] = page.tables[number].size, open = [0];
        const parents = new Int32Array(Math.ceil(width * height / texels)).fill(-1);
        while (open.length) {
            const node = open.pop();
            if (axis(node) > 2) continue;
            for (const child of [left(node), left(node) + 1]) {
                parents[child] = node;
                open.push(child);
            }
        }
        return parents;
    });
}

// Returns the function (state) -> the corners of the triangle to test next, or null.
async function triangleReader(drawn) {
    const {places} = drawn.structure;
    if (!places.v0) return () => null;
    const corners = await Promise.all(["v0", "v1", "v2"].map((name) => reader(drawn, name)));
    const list = places.triangle ? await reader(drawn, "triangle") : (cursor) => cursor;
    return ({cursor}) => list(cursor) < 0 ? null : corners.map((corner) => corner(list(cursor)));
}

// Returns the path of a ray: an element after the set-up and after each step. An element holds the ray's state
// (`fields`), the kernel that runs next, the node or cell (`place`), its box, the triangle under test and the
// interval on the ray. Returns null if the method has no steps, or traces packets. Throws a LostContext.
async function pathOf(method, camera, direction) {
    const drawn = method.schedules.step;
    if (!drawn || searchers(drawn) === "packets") return null;
    const {kernels, lags} = drawn.structure, count = drawn.targets[drawn.start.states].outputs;
    const rows = count * Math.ceil(MOST_STATES / ROW);
    const kept = texture(ROW, rows, 4, null), directions = texture(1, 1, 4, new Float32Array(direction));
    let length = 0;
    const keep = ({framebuffer}, step) => {
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
    await trace(drawn, camera, 1, 1, {directions, most: MOST_STATES - 1, place: "path", seen: keep});
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
                     place: tests && lags ? last && last.place : String(fields.cell || fields.node),
                     triangle: tests ? triangleAt(fields) : null});
        if (fields.phase <= 0) break;       // a ray that has ended keeps its state
    }
    return states;
}

function intervalOf({t_min: lo, t_max: hi, t_enter: enter, t_next: next}) {
    return lo !== undefined ? [lo, hi] : enter !== undefined ? [enter, Math.min(...next)] : null;
}
