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

#include "core/pointer.glsl"
#include "methods/kdtree/kd.glsl"

#define LIST_LENGTH kd_node_count
#include <leaf_list>

void start_search(inout State state);
void take_only_child(inout State state);
void pass_far_child(pointer far, float t_max, inout State state);
void leave_leaf(inout State state, Hit hit);

#include <entries>
#include <interval>

void init(Ray ray, out State state) {
    vec2 interval = box_interval(ray, scene_lo, scene_hi);
    state.node = FIRST;
    state.t_min = max(interval.x, ray.t_min);
    state.t_exit = min(max(box_exit(ray, scene_lo, scene_hi), state.t_min), ray.t_max);
    state.t_max = state.t_exit;
    no_list(state);
    state.phase = state.t_min <= min(interval.y, ray.t_max) ? BEGIN : DONE;
    begin_entries(state);
    start_search(state);
}

// The search ends at a hit before the leaf's end, or at the end of the ray's interval.
bool is_settled(State state, Hit hit) {
    return hit.t < state.t_max || state.t_max >= state.t_exit;
}

// Search the rest of the interval, from `node` downwards.
void search_rest(pointer node, inout State state) {
    state.t_min = resumed(state.t_max);
    state.t_max = state.t_exit;
    state.node = node;
    state.phase = DOWN;
}

// Visit a node: descend into a child, or begin the list of a leaf.
void down(Ray ray, inout State state, inout Hit hit) {
    COUNT(nodes_visited);
    pointer node = state.node;
    int axis = kd_node_axis(node);
    pointer left = kd_node_left(node);
    if (axis >= LEAF) {
        COUNT(leaves_visited);
        open_list(node, left, state);
        state.phase = INTERSECT;
        if (is_empty(left, state)) {
            leave_leaf(state, hit);
        }
    } else {
        float t_split = plane_t(ray, axis, kd_node_split(node));
        float d = along(axis, ray.inv_dir);
        pointer right = moved(left, 1);
        pointer near = d < 0.0 ? right : left;
        pointer far = d < 0.0 ? left : right;
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
    bool ends = list_ends(state);
    if (search_over(hit)) {
        state.phase = DONE;
    } else if (ends) {
        leave_leaf(state, hit);
    }
}
