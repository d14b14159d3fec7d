// Reads a threaded BVH's nodes, as float texels or quantised: the kernels see no difference.

#ifdef SHARED_SUBTREES
#include "methods/bvh/shared_subtrees.glsl"
#endif

#ifdef QUANTISED_NODES

vec3 bvh_node_lo(int i) {
    return decoded(quantised_node_lo_x(i), quantised_node_lo_y(i), quantised_node_lo_z(i));
}

vec3 bvh_node_hi(int i) {
    return decoded(quantised_node_hi_x(i), quantised_node_hi_y(i), quantised_node_hi_z(i));
}

#ifdef SHARED_SUBTREES
int bvh_node_first(int i) {
    int target = int(quantised_node_target(i));
    int inner = quantised_node_portal(i) != 0u ? portal_code(target) : -1;
    return quantised_node_leaf(i) != 0u ? target : inner;
}

bool escapes_to_next(int i) {
    return (quantised_node_leaf(i) | quantised_node_portal(i)) != 0u;
}
#else
int bvh_node_first(int i) {
    return quantised_node_leaf(i) != 0u ? int(quantised_node_target(i)) : -1;
}

bool escapes_to_next(int i) {
    return quantised_node_leaf(i) != 0u;
}
#endif

// A leaf has no children to skip, nor has a portal: its escape index is the next node.
int bvh_node_escape(int i) {
    int target = escapes_to_next(i) ? i + 1 : int(quantised_node_target(i));
    return quantised_node_last(i) != 0u ? -1 : target;
}

#endif
