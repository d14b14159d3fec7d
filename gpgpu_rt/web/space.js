// Draws the scene in space: some edges of its triangles, and the clicked ray's path through the structure. Marks
// the ray's pixel in the picture.

const space = element("space");
const ENDED = "#8a93a0";    // colour of a step after which the ray has ended
const MOST_BOXES = 300;     // older boxes are left out
const MOST_ZOOM = 200;      // at this zoom, the smallest leaves of a large scene can be told apart
// `zoom` and `pan` (in pixels of the drawing) scale and shift the projected scene.
const spaceView = {yaw: 0.6, pitch: 0.3, zoom: 1, pan: [0, 0]};
let wires = null, pivot = null;     // pivot: the point where the ray is at the present step

// Decodes the edges. Corners of triangles are integers from 0 to 4095 across the scene's box.
async function loadWires() {
    const {lo, hi, data} = page.wires, found = await values(data);
    wires = {lo, hi, corners: found.map((x, k) => lo[k % 3] + x / 4095 * (hi[k % 3] - lo[k % 3]))};
}

// A picture of the edges alone. It is drawn again when the view has turned, zoomed or shifted.
const edges = {canvas: document.createElement("canvas"), view: ""};
function sceneEdges() {
    const view = JSON.stringify(spaceView);
    if (edges.view === view) return edges.canvas;
    [edges.view, edges.canvas.width, edges.canvas.height] = [view, space.width, space.height];
    const context = edges.canvas.getContext("2d"), {line} = projector(context), {corners} = wires;
    context.fillStyle = "#fbfbfc";
    context.fillRect(0, 0, space.width, space.height);
    context.strokeStyle = "#d8dbe0";
    context.beginPath();
    for (let k = 0; k < corners.length; k += 9) {
        const points = [0, 3, 6].map((at) => [...corners.subarray(k + at, k + at + 3)]);
        points.forEach((point, at) => line(point, points[(at + 1) % 3]));
    }
    context.stroke();
    return edges.canvas;
}

// Returns four functions: they draw a segment, draw a dot, write a text above points, and return a point's place.
function projector(context) {
    const {lo, hi} = wires, centre = lo.map((x, k) => (x + hi[k]) / 2);
    const radius = Math.hypot(...hi.map((x, k) => x - lo[k])) / 2 || 1, up = unit(page.camera.up);
    const toEye = page.camera.eye.map((x, k) => x - page.camera.target[k]);
    const flat = unit(cross(up, cross(toEye, up)));
    const around = rotated(flat, up, spaceView.yaw), side = unit(cross(up, around));
    const from = rotated(around, side, -spaceView.pitch);
    const eye = centre.map((x, k) => x + 2.4 * radius * from[k]);
    const view = basis({eye, target: centre, up, fov: 48}, 1, 1);
    const [right, top, forward] = [unit(view.right), unit(view.up), view.forward];
    const zoom = 0.5 * space.width / Math.tan(24 * Math.PI / 180), near = 0.05 * radius;
    const along = (a, x, y, z) => a[0] * (x - eye[0]) + a[1] * (y - eye[1]) + a[2] * (z - eye[2]);
    const seen = (p) => [right, top, forward].map((axis) => along(axis, ...p));
    const place = (p) => [zoom * p[0] / p[2], -zoom * p[1] / p[2]].map(
        (x, k) => spaceView.zoom * (space.width / 2 + x) + spaceView.pan[k]);
    const dot = (point) => {
        const p = seen(point);
        if (p[2] < near) return;
        Object.assign(context, {fillStyle: "#c02020", globalAlpha: 1});
        context.beginPath();
        context.arc(...place(p), 6, 0, 2 * Math.PI);
        context.fill();
    };
    const write = (corners, text) => {
        const points = corners.map(seen).filter((p) => p[2] >= near).map(place);
        const [x, y] = points.reduce((a, b) => b[1] < a[1] ? b : a, [Infinity, Infinity]);
        Object.assign(context, {fillStyle: "#20242b", globalAlpha: 1, font: "20px system-ui, sans-serif",
                                textAlign: x < space.width / 2 ? "left" : "right"});
        context.fillText(text, inside(x, 8), inside(y - 8, 24));
    };
    const line = (a, b) => {
        let [p, q] = [seen(a), seen(b)];
        if (p[2] < near && q[2] < near) return;
        if (p[2] < near) [p, q] = [q, p];
        if (q[2] < near) q = q.map((x, k) => x + (p[k] - x) * (near - q[2]) / (p[2] - q[2]));
        const ends = insideEnds(place(p), place(q));
        if (!ends) return;
        context.moveTo(...ends[0]);
        context.lineTo(...ends[1]);
    };
    return {line, dot, write, placeOf: (point) => place(seen(point))};
}

// Returns the ends of the part of a segment that lies in the drawing, or null. A canvas draws long segments slowly, and
// a zoomed segment can be MOST_ZOOM times as long as the drawing.
function insideEnds(a, b) {
    let [from, to] = [0, 1];
    for (const k of [0, 1]) {
        const sides = [-20, space.width + 20].map((side) => (side - a[k]) / (b[k] - a[k]));
        [from, to] = [Math.max(from, Math.min(...sides)), Math.min(to, Math.max(...sides))];
    }
    return from < to ? [from, to].map((share) => a.map((x, k) => x + share * (b[k] - x))) : null;
}

// Returns the place `x` in the drawing, moved at least `margin` pixels inside.
const inside = (x, margin) => Math.max(margin, Math.min(space.width - margin, x));

// Shifts the drawing by pixels, but only as far as the drawing still covers the whole canvas.
function shiftSpace(way) {
    const {zoom, pan} = spaceView;
    spaceView.pan = pan.map((x, k) => Math.max(space.width * (1 - zoom), Math.min(0, x + way[k])));
}

// Zooms the drawing by a factor, about a place of the page. Returns whether the zoom changes.
function zoomSpace(factor, [x, y]) {
    const before = spaceView.zoom, box = space.getBoundingClientRect();
    spaceView.zoom = Math.max(1, Math.min(MOST_ZOOM, before * factor));
    if (spaceView.zoom === before) return false;
    const pixels = space.width / space.clientWidth, growth = spaceView.zoom / before;
    const at = [x - box.left - space.clientLeft, y - box.top - space.clientTop].map((one) => one * pixels);
    shiftSpace(at.map((one, k) => (one - spaceView.pan[k]) * (1 - growth)));
    spaceAt();
    return true;
}

// Turns the drawing by angles. If the drawing is zoomed, the ray's present place stays where it is.
function turnSpace(yaw, pitch) {
    if (!wires) return;
    const {lo, hi} = wires, at = lo.map((x, k) => pivot ? Math.max(x, Math.min(hi[k], pivot[k])) : (x + hi[k]) / 2);
    const seen = () => projector(space.getContext("2d")).placeOf(at), before = seen();
    spaceView.yaw += yaw;
    spaceView.pitch = Math.max(-1.4, Math.min(1.4, spaceView.pitch + pitch));
    const after = seen();
    shiftSpace(before.map((x, k) => x - after[k]));
    spaceAt();
}

const boxCorner = ([lo, hi], number) => lo.map((x, k) => number >> k & 1 ? hi[k] : x);
const BOX_EDGES = [0, 1, 2, 3, 4, 5, 6, 7].flatMap(
    (a) => [1, 2, 4].filter((bit) => !(a & bit)).map((bit) => [a, a | bit]));

// Draws the scene, and the path of a ray (origin, direction, t of its end) up to a step.
function drawSpace(ray, path, step) {
    if (!wires) return;
    const context = space.getContext("2d"), {line, dot, write} = projector(context);
    const stroke = (colour, width, alpha, draws) => {
        Object.assign(context, {strokeStyle: colour, lineWidth: width, globalAlpha: alpha, lineCap: "round"});
        context.beginPath();
        draws();
        context.stroke();
    };
    const box = (corners) => BOX_EDGES.forEach(([a, b]) => line(boxCorner(corners, a), boxCorner(corners, b)));
    const triangle = (corners) => corners.forEach((corner, k) => line(corner, corners[(k + 1) % 3]));
    context.globalAlpha = 1;
    context.drawImage(sceneEdges(), 0, 0);
    stroke("#5b6472", 1, 0.5, () => box([wires.lo, wires.hi]));
    space.dataset.boxes = 0;
    pivot = null;
    if (!ray) return;
    const at = (t) => ray.origin.map((x, k) => x + Math.min(t, ray.end) * ray.direction[k]);
    stroke("#20242b", 1.5, 0.9, () => line(ray.origin, at(Infinity)));
    const present = path ? path[Math.min(step, path.length - 1)] : null;
    pivot = at(present && present.kernel && present.interval ? present.interval[0] : Infinity);
    if (path) {
        const past = path.slice(0, step + 1), boxes = new Map();
        for (const one of past) if (one.box) boxes.set(String(one.box), one);
        const shown = [...boxes.values()].slice(-MOST_BOXES);
        space.dataset.boxes = boxes.size;
        for (const one of shown) stroke(colourOf(one), 1, 0.35, () => box(one.box));
        for (const one of past.slice(-MOST_BOXES)) {
            if (one.triangle) stroke(colourOf(one), 1, 0.6, () => triangle(one.triangle));
        }
        for (const one of past.slice(-MOST_BOXES)) {
            if (one.kernel && one.interval) stroke(colourOf(one), 2.5, 0.5, () => line(...one.interval.map(at)));
        }
        const {latest, restarts} = visitsOf(past);
        if (latest) {
            context.setLineDash([9, 7]);
            stroke("#20242b", 2, 0.9, () => box(latest.box));
            context.setLineDash([]);
            write(Array.from({length: 8}, (_, k) => boxCorner(latest.box, k)),
                  `restart ${restarts}, at ${nodeName(latest)}`);
        }
        if (present.box) stroke(colourOf(present), 2.5, 1, () => box(present.box));
        if (present.triangle) stroke(colourOf(present), 3, 1, () => triangle(present.triangle));
        if (present.kernel && present.interval) {
            stroke(colourOf(present), 5, 1, () => line(...present.interval.map(at)));
        }
    }
    if (ray.hits) dot(at(ray.end));
}

const colourOf = ({fields}) => fields.phase > 0 ? kernelColour(fields.phase) : ENDED;

// Draws a ring around pixel (x, y) of the picture, which has `side` x `side` pixels. The ring's inside is larger than
// the pixel, so that the ring does not hide the pixel.
function markPixel(x, y, side) {
    const place = (at) => `${100 * (at + 0.5) / side}%`, width = `calc(${100 * Math.SQRT2 / side}% + 14px)`;
    Object.assign(element("mark").style, {left: place(x), top: place(y), width});
    element("mark").hidden = false;
}

// Returns a line of text about the path's present step. `structure` is the description by structure.py.
function stepLine(path, step, structure) {
    const present = path[Math.min(step, path.length - 1)], {fields, kernel, interval, triangle} = present;
    const found = visitsOf(path.slice(0, step + 1));
    const number = (x) => Number(x.toPrecision(5));
    const parts = [`step ${Math.min(step, path.length - 1)} of ${path.length - 1}`];
    parts.push(kernel ? `waits for ${kernel}` : fields.phase === 0 ? "has ended" : "was stopped");
    if (kernel && fields.cell) parts.push(`cell (${fields.cell.join(", ")})`);
    else if (kernel && structure.boxes && fields.node >= 0) parts.push(`node ${fields.node}`);
    if (kernel && interval) parts.push(`t = ${interval.map(number).join(" to ")}`);
    if (found.latest === present) parts.push(`restarts at ${nodeName(present)}`);
    if (triangle) parts.push("the triangle under test is bold");
    // The ray has not yet visited the node for which it waits.
    const visited = {...visitsOf(path.slice(0, step)), restarts: found.restarts};
    const counts = structure.boxes ? `; ${visitWords(visited, structure)}` : "";
    return `The ray: ${parts.join(", ")}${counts}.`;
}
