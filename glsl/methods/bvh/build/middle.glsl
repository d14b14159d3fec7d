// The centre of a box. Only its last bit is rounded, in the same way on every renderer.

vec3 middle_of(Box box) {
    PRECISE vec3 middle = box.lo * 0.5 + box.hi * 0.5;
    return middle;
}
