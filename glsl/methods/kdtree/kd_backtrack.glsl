// kd-backtrack: Foley and Sugerman 2005, section 4 (survey, section 3.4, Figure 11 right). A ray that
// leaves a leaf without a hit climbs, one parent per step. The ray stops at the first ancestor whose box
// overlaps the rest of the ray's interval, and descends from there.
//
// The same expression computes the t at which a ray leaves a box or a leaf. If an ancestor's box ends where
// the leaf ended, the two t are equal, and the climb continues to the next ancestor. So the climb ends
// exactly at the ancestor whose far child the ray enters next. The ray's new interval ends where the ray
// leaves the ancestor's box. Otherwise, in the box's last leaf, the interval would extend beyond the box.

#include "methods/kdtree/kd_common.glsl"

void start_search(inout State state) {
}

void take_only_child(inout State state) {
}

void pass_far_child(pointer far, float t_max, inout State state) {
}

void leave_leaf(inout State state, Hit hit) {
    if (is_settled(state, hit)) {
        state.phase = DONE;
    } else {
        state.t_min = resumed(state.t_max);
        state.t_max = state.t_exit;
        state.phase = CLIMB;
    }
}

void climb(Ray ray, inout State state, inout Hit hit) {
    COUNT(nodes_visited);
    state.node = kd_bounds_parent(state.node);
    float t_leave = box_exit(ray, kd_bounds_lo(state.node), kd_bounds_hi(state.node));
    if (t_leave > state.t_min) {
        state.t_max = min(t_leave, state.t_exit);
        state.phase = DOWN;
    } else if (state.node == FIRST) {
        state.phase = DONE;   // the root's bounds, in a narrow number format, may end before t_min
    }
}
