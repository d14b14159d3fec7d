// Axes by number, as the nodes of kd-trees and similar trees store them.

const int LEAF = 3;   // stored in place of an axis; marks the node as a leaf

// For each axis, the component of `a` where `first` holds, else the component of `b`.
vec3 chosen(bvec3 first, vec3 a, vec3 b) {
    return vec3(first.x ? a.x : b.x, first.y ? a.y : b.y, first.z ? a.z : b.z);
}

float along(int axis, vec3 v) {
    return axis == 0 ? v.x : (axis == 1 ? v.y : v.z);
}
