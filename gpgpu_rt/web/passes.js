// Draws the passes of a schedule in order, and repeats its cycles until no ray is alive. A cycle consists of turns.
// After each turn, the states and hits are complete (gpgpu_rt/web/described.py).

// Number of turns between two counts of the live rays. With several cycles, the rays are counted twice as often.
const CHECKED = 16;
const MOST_TURNS = 60000;   // a search that takes more turns is stopped
const MOST_RECTANGLES = 1 << 14;

// Draws the passes of a schedule. Returns the directions, the last states and hits, and how many passes and turns ran.
// The texture `directions` replaces the directions of the camera's rays. `most` limits the turns. `place` names the
// targets, so that simultaneous traces share no target. The trace ends early if `stopped()` is true.
// `seen(states, turns)` is called after the set-up and after each turn. The array `lives` receives the number of live
// packets after the set-up and after each turn; it stays empty if the method traces no packets. Throws a LostContext.
async function trace(schedule, camera, width, height,
                     {directions = null, most = MOST_TURNS, place = "picture", stopped = () => false,
                      seen = null, lives = null} = {}) {
    const check = watched();
    await compiled(schedule.passes);
    const sampled = await Promise.all(schedule.passes.map(tablesOf));
    check();
    stamps.set(place, (stamps.get(place) || 0) + 1);
    const made = schedule.targets.map((one, k) => target(`${place} ${k}`, one, width, height));
    const output = (k, number) => directions && k === 0 && number === 1 ? directions : made[k].textures[number];
    const draws = schedule.passes.map((pass, number) => bound(pass, made, output, sampled[number], {
        rays_texel_0: [...camera.eye, 0],
        ...number > 0 || directions ? {} : basis(camera, width, height)}, [width, height]));
    for (const {framebuffer, textures} of made) {
        gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
        textures.forEach((_, k) => gl.clearBufferfv(gl.COLOR, k, [0, 1, 2, 3].map(() => UNWRITTEN)));
    }

    const after = ({states, hits}) => ({directions: output(0, 1), states: made[states].textures,
                                        framebuffer: made[states].framebuffer, hit: output(...hits)});
    const first = schedule.once.slice(directions ? 1 : 0), {cycles} = schedule;
    first.forEach((number) => draws[number](null));
    let before = null, present = after(schedule.start), turns = 0, passes = schedule.once.length - 1;
    let cycle = cycles[0], live = null, since = performance.now();
    const counts = lives && schedule.repeats && schedule.packets;
    if (counts) lives.push(look(schedule, present.states, place).alive);
    if (seen) await seen(present, turns);
    check();
    while (schedule.repeats && turns < most && !stopped()) {
        // The turns of a single cycle may write to two targets alternately. A ray that has ended must be drawn for one
        // more turn, which writes its last state into the other target too. So the trace ends only if no ray was
        // alive before the last turn.
        const known = cycles.length > 1 ? present : before;
        if (known) {
            live = look(schedule, known.states, place);
            if (live.alive === 0) break;
            cycle = cycles.reduce((a, b) => live.waiting(b.kernel) > live.waiting(a.kernel) ? b : a);
            live.corners = rectanglesOf(live, cycle.kernel);
        }
        for (let k = 0; k < CHECKED && turns < most && !stopped(); k += cycles.length > 1 ? 2 : 1) {
            const turn = cycle.turns[turns % cycle.turns.length];
            for (const number of turn.passes) draws[number](live);
            [before, present] = [present, after(turn)];
            passes += turn.passes.length;
            turns += 1;
            if (counts) lives.push(look(schedule, present.states, place).alive);
            if (seen) {
                await seen(present, turns);
                check();
            }
        }
        if (performance.now() - since > SLICE) {
            await new Promise((next) => setTimeout(next));
            check();
            since = performance.now();
        }
    }
    const {alive, steps} = schedule.repeats ? look(schedule, present.states, place) : {alive: 0, steps: () => 0};
    const found = {...present, passes, alive, turns, steps: steps()};
    check();
    return found;
}

async function tablesOf({inputs}) {
    const found = {};
    for (const [sampler, source] of Object.entries(inputs)) {
        if (source.startsWith("table:")) found[sampler] = await table(Number(source.slice(6)));
    }
    return found;
}

// Returns a function that draws a pass. The function's argument is the result of `look`, or null for all rays.
function bound(pass, made, output, textures, own, rays) {
    const into = made[pass.target], inputs = {...textures}, uniforms = {...pass.uniforms, ...own};
    for (const [sampler, source] of Object.entries(pass.inputs)) {
        if (!(sampler in inputs)) inputs[sampler] = output(...source.split(":").map(Number));
    }
    for (const [name, [k, kind]] of Object.entries(pass.sized)) {
        uniforms[name] = {rays, tile: made[k].tile, across: made[k].across}[kind];
    }
    return (live) => draw(pass.vertex, pass.fragment, into, uniforms, inputs, ...spread(live, into));
}

// Returns the rectangles of live rays in a target (null: the whole target), and the rectangles' unit: one state covers
// a square of unit x unit texels of the target. Each tile of an atlas gets all rectangles.
function spread(live, {tile, across, levels}) {
    const [width, height] = live ? live.size : tile, texels = tile[0] / width;
    if (!live || !live.corners || !Number.isInteger(texels) || tile[1] !== texels * height
        || levels * live.corners.length > 4 * MOST_RECTANGLES) return [null, 1];
    if (levels === 1) return [live.corners, texels];
    const all = new Float32Array(levels * live.corners.length);
    for (let level = 0, at = 0; level < levels; ++level) {
        const corner = [width * (level % across), height * Math.floor(level / across)];
        live.corners.forEach((x, k) => { all[at++] = corner[k % 2] + Math.min(x, live.size[k % 2]); });
    }
    return [all, texels];
}

// Returns what owns a state: "rays", or "packets" of several rays.
function searchers(schedule) {
    return schedule.targets[schedule.start.states].of.some((size) => size < 1) ? "packets" : "rays";
}

function field(schedule, name) {
    const [, texel, swizzle] = schedule.state.find(([known]) => known === name);
    return [texel, "xyzw".indexOf(swizzle)];
}

// Counts the rays, or packets, that wait for each kernel, in squares of TILE x TILE. `steps()` of the result returns
// the largest number of steps of a ray.
function look(schedule, states, place) {
    const [[phase, a], [steps, b]] = [field(schedule, "phase"), field(schedule, "steps")];
    const size = sizeOf.get(states[phase]), [across, down] = size.map((length) => Math.ceil(length / TILE));
    const into = target(`${place} alive`, {outputs: 2}, across, down);
    draw(page.own.whole, page.own.alive, into, {places: [a, b]}, {phases: states[phase], counts: states[steps]});
    const squares = read(into), sums = [0, 0, 0, 0];
    squares.forEach((count, k) => { sums[k % 4] += count; });
    const alive = sums.reduce((sum, count) => sum + count);
    return {squares, across, down, size, alive, waiting: (kernel) => kernel ? sums[kernel - 1] : alive,
            steps: () => read(into, 1).reduce((most, count) => Math.max(most, count), 0)};
}

// Returns the corners of rectangles around the rays that wait for `kernel` (0: for any kernel). A rectangle is a run of
// squares in a row. Returns null if the rectangles cover all squares.
function rectanglesOf({squares, across, down}, kernel) {
    const corners = [], waits = (at) => kernel ? squares[at + kernel - 1] > 0
        : squares[at] + squares[at + 1] + squares[at + 2] + squares[at + 3] > 0;
    for (let y = 0; y < down; ++y) {
        for (let x = 0; x < across; ++x) {
            const first = x;
            while (x < across && waits(4 * (y * across + x))) x += 1;
            if (x > first) corners.push(TILE * first, TILE * y, TILE * x, TILE * (y + 1));
        }
    }
    const whole = corners.length === 4 * down && corners.every((x, k) => k % 4 || x === 0)
        && corners.every((x, k) => k % 4 !== 2 || x === TILE * across);
    return whole ? null : Float32Array.from(corners);
}
