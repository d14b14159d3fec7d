// Lets the eight octant copies of a threaded BVH share subtrees. A shared subtree is stored once, behind
// the copies, in the order of the original tree. In each copy, one node, a portal, represents the subtree.
// A walk that enters a portal continues in the shared nodes and then returns to the node behind the portal.
// The walk stores the node behind the portal in `after` (-1 outside shared subtrees).

#define AFTER(state) state.after
#define PORTAL(i) quantised_node_portal(i)

// Order the corners of a box along the rays. The stored order cannot suit all octants that share a box.
void order_corners(bvec3 negative, inout vec3 lo, inout vec3 hi) {
    vec3 lower = lo;
    lo = mix(lo, hi, negative);
    hi = mix(hi, lower, negative);
}

// The next node after a node's subtree: the node's escape index, or `after` at the end of a shared subtree.
int behind(int escape, int after) {
    return escape < 0 ? after : escape;
}

// The first node below an inner node or a portal. `first` is the node's field of this name.
int below(int node, int first) {
    return is_portal(first) ? portal_code(first) : node + 1;
}

// The value of `after` when a walk moves on from a node. If `down`, the walk enters the node's subtree,
// else it continues at the node `past`.
int way_out(int first, int escape, int past, bool down, int after) {
    int inside = is_portal(first) ? past : after;
    int outside = escape < 0 ? -1 : after;
    return down ? inside : outside;
}
