// What the passes counted: the rays that are alive after each step, and the scale of the heat map.

// Returns the numbers of rays that are alive after 0, 1, 2, ... steps, the step after which none is alive, and the
// 99th percentile of the rays' steps. A ray is alive after k steps if it took more than k steps.
function survey(schedule, states) {
    const [texel, channel] = field(schedule, "steps"), [width, height] = sizeOf.get(states[texel]);
    const values = readTexture(states[texel], width, height);
    const taken = new Float32Array(width * height).map((_, k) => values[4 * k + channel]).sort();
    const most = taken[taken.length - 1], alive = [];
    for (let step = 0, first = 0; step <= most; ++step) {
        while (first < taken.length && taken[first] <= step) ++first;
        alive.push(taken.length - first);
    }
    return {alive, last: most, rays: taken.length, percentile: Math.max(1, taken[Math.floor(0.99 * (taken.length - 1))])};
}

// Draws the curve of live rays, with a mark at the present step.
function drawAlive(found, step) {
    const chart = element("alive"), context = chart.getContext("2d"), {width, height} = chart;
    context.clearRect(0, 0, width, height);
    element("alive-text").textContent = "";
    if (!found || !found.alive) return;
    const {alive, rays} = found, last = Math.max(1, alive.length - 1);
    const x = (k) => k / last * (width - 1), y = (count) => height - count / rays * (height - 2);
    context.beginPath();
    context.moveTo(0, height);
    alive.forEach((count, k) => {
        context.lineTo(x(k), y(count));
        context.lineTo(x(k + 1), y(count));
    });
    context.lineTo(width, height);
    context.fillStyle = "#b9cfe4";
    context.fill();
    context.fillStyle = "#c02020";
    context.fillRect(Math.min(width - 2, x(step)), 0, 2, height);
    const count = alive[Math.min(step, alive.length - 1)];
    element("alive-text").textContent = `${count.toLocaleString("en")} of ${rays.toLocaleString("en")} rays are alive `
        + `(${(100 * count / rays).toFixed(1)} %)`;
}

// Draws the legends by the program that draws the picture: a ray for each colour.
function drawLegends() {
    const ramp = 256, pixels = ramp + 4;
    const [counts, phases] = [1, 2].map(() => new Float32Array(4 * pixels));
    for (let k = 0; k < ramp; ++k) counts[4 * k] = k / (ramp - 1);
    for (let k = 0; k < 4; ++k) phases[4 * (ramp + k)] = k + 1;
    const [hits, miss] = [new Float32Array(4 * pixels).fill(NO_TRIANGLE), texture(1, 1, 4, new Float32Array(4))];
    const inputs = {hits: texture(pixels, 1, 4, hits), surfaces: miss, phases: texture(pixels, 1, 4, phases),
                    directions: texture(pixels, 1, 4, new Float32Array(4 * pixels).fill(1)),
                    counts: texture(pixels, 1, 4, counts)};
    const into = target("legend 0", {outputs: 1}, pixels, 1), colours = (most) => {
        draw(page.whole, page.show, into, {places: [0, 0], stepwise: 1, most, size: [pixels, 1]}, inputs);
        return read(into);
    };
    const css = (values, k) => `rgb(${[0, 1, 2].map((c) => Math.round(255 * values[4 * k + c])).join(" ")})`;
    const context = element("ramp").getContext("2d"), heat = colours(1), waits = colours(0);
    for (let k = 0; k < ramp; ++k) {
        context.fillStyle = css(heat, k);
        context.fillRect(k, 0, 1, element("ramp").height);
    }
    Object.values(inputs).forEach((one) => gl.deleteTexture(one));
    freeTargets("legend");
    return [0, 1, 2, 3].map((k) => css(waits, ramp + k));
}

// Names the kernels beside their colours, and the steps beside the colours of the heat.
function nameLegends(kernels, waiting, scale) {
    element("waits").replaceChildren(...kernels.map((name, k) => {
        const one = document.createElement("span"), chip = document.createElement("i");
        chip.style.background = waiting[Math.min(k, 2)];
        one.append(chip, `waits for ${name}`);
        return one;
    }));
    element("ticks").replaceChildren(...[0, 1, 2, 3].map((k) => {
        const one = document.createElement("span");
        one.textContent = `${Number((scale * k / 3).toFixed(scale < 9 ? 1 : 0))}${k === 3 ? " steps or more" : ""}`;
        return one;
    }));
}
