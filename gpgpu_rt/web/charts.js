// Shows how many rays are alive after each step, and the scale of the heat map.

// The kernels' colours, which page.py writes into the style. Further kernels have the last colour.
const KERNEL_COLOURS = [1, 2, 3, 4].map(
    (k) => getComputedStyle(document.documentElement).getPropertyValue(`--kernel-${k}`).trim());

// The colours of show.frag.
const SHOWN_COLOURS = {kernel_colours: KERNEL_COLOURS.flatMap(
    (colour) => [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16) / 255)), heat_colours: page.heat};

const kernelColour = (phase) => KERNEL_COLOURS[Math.min(phase, KERNEL_COLOURS.length) - 1];

// Counts the rays (or packets) of a whole search. Returns, among others:
// `alive`: how many are alive after 0, 1, 2, ... steps; `last`: the step after which none is alive;
// `percentile`: the 99th percentile of their numbers of steps.
// A ray ends after the step that its field `steps` gives. A packet's field leaves out pushes and pops, so for packets,
// `lives` has the numbers of live packets.
function survey(schedule, states, lives = []) {
    const [texel, channel] = field(schedule, "steps"), [width, height] = sizeOf.get(states[texel]);
    const values = readTexture(states[texel], width, height);
    const taken = new Float32Array(width * height).map((_, k) => values[4 * k + channel]).sort();
    const most = taken[taken.length - 1], alive = [];
    for (let step = 0, first = 0; step <= most; ++step) {
        while (first < taken.length && taken[first] <= step) ++first;
        alive.push(taken.length - first);
    }
    const known = lives.length ? lives.slice(0, lives.indexOf(0) + 1 || lives.length) : alive;
    return {alive: known, last: known.length - 1, all: taken.length, noun: searchers(schedule),
            percentile: Math.max(1, taken[Math.floor(0.99 * (taken.length - 1))])};
}

// Draws the curve of live rays. Marks the present step, and the step `end` at which the clicked ray ends (or null).
function drawAlive(found, step, end) {
    const chart = element("alive"), context = chart.getContext("2d"), {width, height} = chart;
    context.clearRect(0, 0, width, height);
    element("alive-text").textContent = "";
    if (!found || !found.alive) return;
    const {alive, all, noun} = found, last = Math.max(1, alive.length - 1);
    const x = (k) => k / last * (width - 1), y = (count) => height - count / all * (height - 2);
    context.beginPath();
    context.moveTo(0, height);
    alive.forEach((count, k) => {
        context.lineTo(x(k), y(count));
        context.lineTo(x(k + 1), y(count));
    });
    context.lineTo(width, height);
    context.fillStyle = "#b9cfe4";
    context.fill();
    if (end !== null) {
        context.fillStyle = "#20242b";
        context.setLineDash([4, 3]);
        context.strokeRect(Math.min(width - 1, x(end)), -1, 0, height + 2);
        Object.assign(context, {font: "12px system-ui, sans-serif", textAlign: x(end) < width / 2 ? "left" : "right"});
        context.fillText(" end of this ray ", x(end), 12);
        context.setLineDash([]);
    }
    context.fillStyle = "#c02020";
    context.fillRect(Math.min(width - 2, x(step)), 0, 2, height);
    const count = alive[Math.min(step, alive.length - 1)];
    element("alive-text").textContent = `${count.toLocaleString("en")} of ${all.toLocaleString("en")} ${noun} `
        + `are alive (${(100 * count / all).toFixed(1)} %)`;
}

// Draws the heat map's scale: the picture's program draws a row of rays whose step counts increase.
function drawRamp() {
    const {width: pixels, height} = element("ramp"), context = element("ramp").getContext("2d");
    const counts = new Float32Array(4 * pixels).map((_, k) => k % 4 ? 0 : k / 4 / (pixels - 1));
    const zeros = texture(pixels, 1, 4, new Float32Array(4 * pixels));
    const inputs = {hits: zeros, surfaces: zeros, phases: zeros, directions: zeros,
                    counts: texture(pixels, 1, 4, counts)};
    const into = target("legend 0", {outputs: 1}, pixels, 1);
    draw(page.own.whole, page.own.show, into, {places: [0, 0], stepwise: 1, most: 1, size: [pixels, 1],
                                       ...SHOWN_COLOURS}, inputs);
    const colours = read(into);
    for (let k = 0; k < pixels; ++k) {
        context.fillStyle = `rgb(${[0, 1, 2].map((c) => Math.round(255 * colours[4 * k + c])).join(" ")})`;
        context.fillRect(k, 0, 1, height);
    }
    for (const one of [zeros, inputs.counts]) gl.deleteTexture(one);
    freeTargets("legend");
}

// Writes the kernels' names beside their colours, and numbers of steps below the heat map's scale.
function nameLegends(kernels, scale) {
    element("waits").replaceChildren(...kernels.map((name, k) => {
        const one = document.createElement("span"), chip = document.createElement("i");
        chip.style.background = kernelColour(k + 1);
        one.append(chip, `waits for ${name}`);
        return one;
    }));
    element("ticks").replaceChildren(...[0, 1, 2, 3].map((k) => {
        const one = document.createElement("span");
        one.textContent = `${Number((scale * k / 3).toFixed(scale < 9 ? 1 : 0))}${k === 3 ? " steps or more" : ""}`;
        return one;
    }));
}
