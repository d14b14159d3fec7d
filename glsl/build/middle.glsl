// The middle of a box, in units of about the scene's size: `unit` is a power of two, so that only
// the middle itself is rounded, the same way on every renderer.

uniform float unit;

vec3 middle_of(Box box) {
    PRECISE vec3 middle = box.lo * unit * 0.5 + box.hi * unit * 0.5;
    return middle;
}
