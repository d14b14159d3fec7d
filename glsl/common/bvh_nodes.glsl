// Reads a threaded BVH's nodes, as float texels or quantised: the kernels see no difference.
// Quantised bounds are steps of the scene's box, rounded outward by the builder against the very
// expression here, so that every box holds what it held.

#ifdef QUANTISED_NODES

uniform vec3 quantum;

vec3 bvh_node_lo(int i) {
    uvec3 q = uvec3(quantised_node_lo_x(i), quantised_node_lo_y(i), quantised_node_lo_z(i));
    return R(scene_lo + R(vec3(q) * quantum));
}

vec3 bvh_node_hi(int i) {
    uvec3 q = uvec3(quantised_node_hi_x(i), quantised_node_hi_y(i), quantised_node_hi_z(i));
    return R(scene_lo + R(vec3(q) * quantum));
}

int bvh_node_first(int i) {
    return quantised_node_leaf(i) != 0u ? int(quantised_node_target(i)) : -1;
}

// A leaf has no children to skip: its escape index is the next node.
int bvh_node_escape(int i) {
    int target = quantised_node_leaf(i) != 0u ? i + 1 : int(quantised_node_target(i));
    return quantised_node_last(i) != 0u ? -1 : target;
}

#endif
