// Counts how often a ray's path enters nodes or cells, and how often it restarts.

// Counts the visits in a path's states. A visit begins where the path enters another node. The visit is a restart if
// the path visited the node before, and the node's box encloses the box of the node that the path leaves. A restart
// leads to the root, or with push-down to a lower ancestor. A climb to a parent is no restart. Paths through cells,
// ropes or escape indices have no restarts. `times`: node -> number of visits; `latest`: the state of the last restart,
// or null.
function visitsOf(states) {
    const times = new Map();
    let visits = 0, restarts = 0, latest = null, last = null;
    for (const [k, one] of states.entries()) {
        if (!one.box) continue;
        const key = one.place;
        if (last && key === last.place) continue;
        if (times.has(key) && encloses(one.box, last.box) && states[k - 1].kernel !== "climb") {
            restarts += 1;
            latest = one;
        }
        times.set(key, (times.get(key) || 0) + 1);
        visits += 1;
        last = one;
    }
    return {visits, restarts, latest, times};
}

function encloses([lo, hi], [inner, outer]) {
    return lo.every((x, k) => x <= inner[k]) && hi.every((x, k) => x >= outer[k]);
}

const several = (count, noun) => `${count.toLocaleString("en")} ${noun}${count === 1 ? "" : "s"}`;

// Returns the counts in words. `structure` is the description by structure.py. The words count restarts only if
// `structure.restarts` is true.
function visitWords({visits, restarts, times}, structure) {
    if (structure.boxes === "cells") return `${several(times.size, "cell")} so far`;
    const jumps = structure.restarts ? `, ${several(restarts, "restart")}` : "";
    return `${several(visits, "visit")} to ${several(times.size, "node")}${jumps} so far`;
}

// Returns the name of the node where a path restarts.
const nodeName = ({fields}) => fields.node === 0 ? "the root" : `node ${fields.node}`;
