// The criterion of a kd-tree (see tree_unit.glsl): the split plane cuts the ray's interval in the node into
// the intervals for the near and the far child.
//
// The same expression computes the t of a split plane and of a face of a box. So a ray that climbs from a
// leaf to a far child computes exactly the interval that a stack would have stored for this child. If
// t_split equals t_min or t_max, the ray enters both children.

#include "methods/kdtree/kd.glsl"

void choose(Ray ray, pointer node, int axis, pointer near, pointer far, State state, Hit hit,
            out vec2 near_interval, out vec2 far_interval) {
    float t_split = plane_t(ray, axis, unit_node_split(node));
    near_interval = vec2(state.t_min, min(t_split, state.t_max));
    far_interval = vec2(max(t_split, state.t_min), state.t_max);
}

vec2 interval_in(Ray ray, pointer node) {
    vec3 lo = unit_bounds_lo(node);
    vec3 hi = unit_bounds_hi(node);
    return vec2(box_entry(ray, lo, hi), box_exit(ray, lo, hi));
}

// Leaves do not overlap, so a hit before the leaf's end is the nearest hit.
bool is_settled(State state, Hit hit) {
    return hit.t < state.t_max;
}
