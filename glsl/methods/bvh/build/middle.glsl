// The centre of a box. Halving is exact: only the sum is rounded, so every renderer gets the same bits.

vec3 middle_of(Box box) {
    PRECISE vec3 middle = box.lo * 0.5 + box.hi * 0.5;
    return middle;
}
