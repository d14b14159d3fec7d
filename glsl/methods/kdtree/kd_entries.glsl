// A ray searches the subtrees in its tile's entry list (stages/entry_points.frag), one after another.

#include "stages/entry_list.glsl"

#define BEGIN ENTER

void begin_entries(inout State state) {
    state.root = state.entry = 0;
}

// The node at which a restart begins: the root of the current subtree.
int root_of(State state) {
    return state.root;
}

// End the search of a subtree: the ray is done if it has a hit before it leaves the subtree's box.
// Otherwise the next subtree of the list follows.
void settle(inout State state, Hit hit) {
    state.phase = hit.t < state.t_max ? DONE : ENTER;
}

// Advance to the next subtree of the list, and search this subtree if the ray meets its box. The ray's
// interval in the box is computed by the same expression as the t of splits, so the intervals of adjacent
// subtrees meet exactly.
void enter(Ray ray, inout State state, inout Hit hit) {
    int code = entry_code(ivec2(gl_FragCoord.xy) / ENTRY_TILE, state.entry);
    ++state.entry;
    if (code == LIST_END) {
        state.phase = DONE;
    } else {
        COUNT(nodes_visited);
        int node = entry_node(code, 0);
        vec3 lo = kd_bounds_lo(node);
        vec3 hi = kd_bounds_hi(node);
        float start = max(box_interval(ray, scene_lo, scene_hi).x, ray.t_min);
        float exit = min(max(box_exit(ray, scene_lo, scene_hi), start), ray.t_max);
        float t_first = max(start, box_entry(ray, lo, hi));
        float t_last = min(exit, max(box_exit(ray, lo, hi), start));
        if (t_first <= min(t_last, hit.t)) {
            state.node = state.root = node;
            state.t_min = t_first;
            state.t_max = state.t_exit = t_last;
            state.phase = DOWN;
            start_search(state);
        }
    }
}
