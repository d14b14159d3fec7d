// Reads a threaded BVH's nodes, as float texels or quantised: the kernels see no difference.

#ifdef QUANTISED_NODES

vec3 bvh_node_lo(int i) {
    return decoded(quantised_node_lo_x(i), quantised_node_lo_y(i), quantised_node_lo_z(i));
}

vec3 bvh_node_hi(int i) {
    return decoded(quantised_node_hi_x(i), quantised_node_hi_y(i), quantised_node_hi_z(i));
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
