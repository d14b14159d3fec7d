// The criterion of a BVH (see tree_unit.glsl): a ray searches a child if it meets the child's box. The
// boxes may overlap, so a hit in one leaf never ends the search.

vec2 interval_in(Ray ray, pointer node) {
    return box_interval(ray, unit_bounds_lo(node), unit_bounds_hi(node));
}

vec2 searched(Ray ray, pointer node, Hit hit) {
    vec2 interval = interval_in(ray, node);
    return vec2(max(interval.x, ray.t_min), min(interval.y, hit.t));
}

void choose(Ray ray, pointer node, int axis, pointer near, pointer far, State state, Hit hit,
            out vec2 near_interval, out vec2 far_interval) {
    near_interval = searched(ray, near, hit);
    far_interval = searched(ray, far, hit);
}

bool is_settled(State state, Hit hit) {
    return false;
}
