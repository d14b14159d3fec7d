// Axes are numbered 0 to 2. `chosen` selects each component from `a` where `is_a` is true, else from `b`.

const int LEAF = 3;   // stored in place of an axis; marks the node as a leaf

vec3 chosen(bvec3 is_a, vec3 a, vec3 b) {
    return vec3(is_a.x ? a.x : b.x, is_a.y ? a.y : b.y, is_a.z ? a.z : b.z);
}

float along(int axis, vec3 v) {
    return axis == 0 ? v.x : (axis == 1 ? v.y : v.z);
}
