// Subtrees that the eight octant copies of a threaded BVH share. A shared subtree is stored once, behind the
// copies, in the tree's own order. In each copy a portal stands for the subtree. A walk that enters a portal
// goes on at the shared nodes, and returns to the node behind the portal where the shared nodes end.
//
// A walk keeps that node in `after`, which is -1 outside shared subtrees.

#define AFTER(state) state.after
#define PORTAL(i) quantised_node_portal(i)

// Order the corners of a box along the rays: shared subtrees serve every octant.
void order_corners(bvec3 negative, inout vec3 lo, inout vec3 hi) {
    vec3 lower = lo;
    lo = mix(lo, hi, negative);
    hi = mix(hi, lower, negative);
}

// The node behind a node: its escape index, or `after` where the shared subtree ends.
int behind(int escape, int after) {
    return escape < 0 ? after : escape;
}

// The first node below an inner node or a portal, by the field `first`.
int below(int node, int first) {
    return is_portal(first) ? portal_code(first) : node + 1;
}

// The new `after` of a walk that leaves a node, `down` below it or to `past`.
int way_out(int first, int escape, int past, bool down, int after) {
    int inside = is_portal(first) ? past : after;
    int outside = escape < 0 ? -1 : after;
    return down ? inside : outside;
}
