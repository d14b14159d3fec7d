// Subtrees that stand once for all eight orders of a threaded BVH, behind them. What stands for one in an
// order is its portal: a walk that enters it goes on at the shared nodes, in the tree's own order, and where
// these end it comes back to behind the portal. `after` is that node, or -1 outside of shared subtrees.

// A portal's field `first` from the first node below it, and back; it is below -1.
int portal_code(int node) {
    return -2 - node;
}

bool is_portal(int first) {
    return first < -1;
}

// Octant copies that share have their corners in no ray's order.
void order_corners(bvec3 negative, inout vec3 lo, inout vec3 hi) {
    vec3 lower = lo;
    lo = mix(lo, hi, negative);
    hi = mix(hi, lower, negative);
}

// What comes behind a node: its escape index, or where its shared subtree ends, `after`.
int behind(int escape, int after) {
    return escape < 0 ? after : escape;
}

// What comes first below an inner node, by its field `first`.
int below(int node, int first) {
    return is_portal(first) ? portal_code(first) : node + 1;
}

// What becomes of `after` where a walk goes on from a node, `down` below it or to `past`.
int way_out(int first, int escape, int past, bool down, int after) {
    int inside = is_portal(first) ? past : after;
    int outside = escape < 0 ? -1 : after;
    return down ? inside : outside;
}
