// The shared part of all kd-tree traversals of single rays. A ray descends to the leaf at its t_min, tests
// the leaf's triangles one by one, and leaves the leaf. Source: Foley and Sugerman, "KD-Tree Acceleration
// Structures for a GPU Raytracer", Graphics Hardware 2005 (survey, section 3.4, Figures 10 to 12).
//
// A method's own file defines four functions. `start_search` begins a search. `take_only_child` is called
// if a node sends the ray to one child, and `pass_far_child` if a node sends the ray to both children.
// `leave_leaf` continues behind a leaf. Options choose the files behind <entries> (where a search begins)
// and <interval> (where a ray continues behind a leaf).
//
// Departure: in the survey's Figure 10, a ray also enters the near child if t_split < 0. This is wrong: a
// negative t_split can mean that the ray starts beyond the plane.

#include "methods/kdtree/kd.glsl"

void start_search(inout State state);
void take_only_child(inout State state);
void pass_far_child(int far, float t_max, inout State state);
void leave_leaf(inout State state, Hit hit);

#include <entries>
#include <interval>

void init(Ray ray, out State state) {
    vec2 interval = box_interval(ray, scene_lo, scene_hi);
    state.node = 0;
    state.t_min = max(interval.x, ray.t_min);
    state.t_exit = min(max(box_exit(ray, scene_lo, scene_hi), state.t_min), ray.t_max);
    state.t_max = state.t_exit;
    state.cursor = 0;
    state.end = 0;
    state.phase = state.t_min <= min(interval.y, ray.t_max) ? BEGIN : DONE;
    begin_entries(state);
    start_search(state);
}

// The search ends at a hit before the leaf's end, or at the end of the ray's interval. (Without a hit,
// hit.t is the ray's t_max.)
bool is_settled(State state, Hit hit) {
    return hit.t < state.t_max || state.t_max >= state.t_exit;
}

// Search the rest of the interval, from `node` downwards.
void search_rest(int node, inout State state) {
    state.t_min = resumed(state.t_max);
    state.t_max = state.t_exit;
    state.node = node;
    state.phase = DOWN;
}

// Visit a node: go on to a child, or to the triangles of a leaf.
void down(Ray ray, inout State state, inout Hit hit) {
    COUNT(nodes_visited);
    int node = state.node;
    int axis = kd_node_axis(node);
    int left = kd_node_left(node);
    if (axis >= LEAF) {
        COUNT(leaves_visited);
        state.cursor = left;
        state.end = left + kd_node_count(node);
        state.phase = INTERSECT;
        if (state.cursor == state.end) {
            leave_leaf(state, hit);
        }
    } else {
        float t_split = plane_t(ray, axis, kd_node_split(node));
        float d = along(axis, ray.inv_dir);
        int near = d < 0.0 ? left + 1 : left;
        int far = d < 0.0 ? left : left + 1;
        bool takes_far = takes_far_child(t_split, state.t_min);
        state.node = takes_far ? far : near;
        if (takes_far || t_split >= state.t_max) {
            take_only_child(state);
        } else {
            float t_max = state.t_max;
            state.t_max = t_split;
            pass_far_child(far, t_max, state);
        }
    }
}

// Test one triangle of the leaf's list. A hit beyond the leaf's end is kept, but the search continues.
void intersect(Ray ray, inout State state, inout Hit hit) {
    test_triangle(ray, reference_triangle(state.cursor), hit);
    ++state.cursor;
    if (search_over(hit)) {
        state.phase = DONE;
    } else if (state.cursor == state.end) {
        leave_leaf(state, hit);
    }
}
