// The self-test: the hits of the test rays must equal the known hits to the bit.

function announceTest() {
    element("selftest").replaceChildren();
    element("selftest").dataset.state = "running";
    element("verdict").textContent = "The test rays are being traced.";
}

// Traces the test rays with each method and schedule. `idle` waits for the reader's own picture. Throws a LostContext.
async function selfTest(idle) {
    const report = element("selftest"), check = watched();
    let rays = 0, differing = 0;
    for (const method of page.methods) {
        const line = document.createElement("span");
        line.className = "method";
        line.dataset.method = method.name;
        if (!runnable.includes(method)) {
            line.textContent = [`${method.name}: not tested`, ...method.missing].join("; ");
            report.append(line);
            continue;
        }
        const {side, eye} = method.test;
        const given = await values(method.test.directions), right = await values(method.test.hits);
        check();
        const bits = new Uint32Array(right.buffer), directions = texture(side, side, 4, given);
        let wrong = 0, traced = 0;
        for (const schedule of Object.values(method.schedules)) {
            const {hit} = await trace(schedule, {eye}, side, side, {directions, place: "test", seen: idle});
            const found = readTexture(hit, side, side), foundBits = new Uint32Array(found.buffer);
            check();
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
        Object.assign(line.dataset, {rays: traced, differing: wrong});
        line.textContent = [`${method.name}: ${wrong === 0 ? "exact" : `${wrong} of ${traced} differ`}`,
                            ...method.missing].join("; ");
        report.append(line);
        rays += traced;
        differing += wrong;
    }
    Object.assign(report.dataset, {state: "done", rays, differing});
    const untested = page.methods.filter((method) => !runnable.includes(method)).map(({name}) => name);
    const verdict = differing === 0
        ? `${untested.length ? "The" : "All"} ${rays.toLocaleString("en")} test rays have the known hits, to the bit.`
        : `${differing.toLocaleString("en")} of ${rays.toLocaleString("en")} test rays differ from the known `
          + "hits on this graphics card, so its pictures are not exact.";
    element("verdict").textContent = verdict
        + (untested.length ? ` Not tested, because this card has too few render targets: ${untested.join(", ")}.` : "");
}
