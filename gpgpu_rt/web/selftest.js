// The self-test: known rays, whose hits must be the same to the bit.

// `idle` waits while the reader's own picture is traced. `lost` says that the context was lost meanwhile.
async function selfTest(idle, lost) {
    const report = element("selftest");
    report.replaceChildren();
    report.dataset.state = "running";
    let rays = 0, differing = 0;
    for (const method of page.methods) {
        const {side, eye} = method.test;
        const given = await values(method.test.directions), right = await values(method.test.hits);
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
        line.textContent = [`${method.name}: ${wrong === 0 ? "exact" : `${wrong} of ${traced} differ`}`,
                            ...method.missing].join("; ");
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
