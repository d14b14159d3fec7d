// Reads the nodes of a threaded BVH. The same functions read float texels or quantised texels.
//
// The field `first` is the first triangle of a leaf, -1 at an inner node, and less than -1 at a portal. A
// portal leads to a subtree that the octant copies share (shared_subtrees.glsl).

// Convert the number of the first node below a portal to the portal's field `first`, or back.
int portal_code(int node) {
    return -2 - node;
}

bool is_portal(int first) {
    return first < -1;
}

#include "core/pointer.glsl"
#include <subtrees>

#ifdef QUANTISED_NODES

vec3 bvh_node_lo(int i) {
    return decoded(quantised_node_lo_x(i), quantised_node_lo_y(i), quantised_node_lo_z(i));
}

vec3 bvh_node_hi(int i) {
    return decoded(quantised_node_hi_x(i), quantised_node_hi_y(i), quantised_node_hi_z(i));
}

int bvh_node_first(int i) {
    int target = int(quantised_node_target(i));
    int inner = PORTAL(i) != 0u ? portal_code(target) : -1;
    return quantised_node_leaf(i) != 0u ? target : inner;
}

// The escape index of a leaf or a portal is the next node, because neither has children to skip.
bool escapes_to_next(int i) {
    return (quantised_node_leaf(i) | PORTAL(i)) != 0u;
}

int bvh_node_escape(int i) {
    int target = escapes_to_next(i) ? i + 1 : int(quantised_node_target(i));
    return quantised_node_last(i) != 0u ? -1 : target;
}

#endif
