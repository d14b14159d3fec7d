// Vectors of three numbers, and the basis of a camera.
"use strict";

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const scaled = (a, factor) => a.map((x) => x * factor);
const unit = (a) => scaled(a, 1 / Math.hypot(...a));

function basis({eye, target: at, up, fov}, width, height) {
    const forward = unit(at.map((x, k) => x - eye[k]));
    const right = unit(cross(forward, up));
    const half = Math.tan(fov * Math.PI / 360);
    return {eye, forward, right: scaled(right, half * width / height), up: scaled(cross(right, forward), half),
            size: [width, height]};
}

// Returns a vector turned about an axis of length 1, by an angle in radians.
function rotated(v, axis, angle) {
    const c = Math.cos(angle), s = Math.sin(angle), along = v.reduce((sum, x, k) => sum + x * axis[k], 0);
    const side = cross(axis, v);
    return v.map((x, k) => x * c + side[k] * s + axis[k] * along * (1 - c));
}
