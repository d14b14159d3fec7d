// tree-unit: the tree traversal that the survey proposes for hardware (section 5, "Ray Tracing Hardware
// Architecture"). One traversal serves kd-trees and BVHs; a programmable criterion chooses the children of
// a node. The survey gives no details; the details here are the project's own.
//
// The option `criterion` chooses the file behind <criterion>. The file defines three functions. `choose`
// computes the intervals in which the ray searches the two children of a node; an interval (x, y) is empty
// if x > y. `interval_in` computes the interval of the ray in a node's box. `is_settled` returns whether no
// node beyond the current leaf can hold a nearer hit.
//
// This file handles links, leaves and the way back to parents. A stack in a local array would be lost
// between passes, so a ray climbs one level per step, as in kd-backtrack (Foley and Sugerman 2005). From a
// near child, the ray goes to the far sibling if it meets the sibling's box before its nearest hit.

#include "core/axis.glsl"
#include "core/pointer.glsl"

#define LIST_LENGTH unit_node_count
#include <leaf_list>

// Return whether a ray reaches the right child of a node first. The node is split along `axis`.
bool goes_down(Ray ray, int axis) {
    return along(axis, ray.inv_dir) < 0.0;
}

#include <criterion>

void search(pointer node, vec2 interval, inout State state) {
    state.node = node;
    state.t_min = interval.x;
    state.t_max = interval.y;
    state.phase = DOWN;
}

void init(Ray ray, out State state) {
    vec2 interval = box_interval(ray, scene_lo, scene_hi);
    interval = vec2(max(interval.x, ray.t_min), min(interval.y, ray.t_max));
    no_list(state);
    search(FIRST, interval, state);
    if (interval.x > interval.y) {
        state.phase = DONE;
    }
}

void leave_leaf(inout State state, Hit hit) {
    state.phase = is_settled(state, hit) ? DONE : CLIMB;
}

// Visit a node: descend into a child, or begin the list of a leaf.
void down(Ray ray, inout State state, inout Hit hit) {
    COUNT(nodes_visited);
    pointer node = state.node;
    int axis = unit_node_axis(node);
    pointer child = unit_node_child(node);
    if (axis >= LEAF) {
        COUNT(leaves_visited);
        open_list(node, child, state);
        state.phase = INTERSECT;
        if (is_empty(child, state)) {
            leave_leaf(state, hit);
        }
    } else {
        bool right_first = goes_down(ray, axis);
        pointer right = moved(child, 1);
        pointer near = right_first ? right : child;
        pointer far = right_first ? child : right;
        vec2 near_interval;
        vec2 far_interval;
        choose(ray, node, axis, near, far, state, hit, near_interval, far_interval);
        if (near_interval.x <= near_interval.y) {
            search(near, near_interval, state);
        } else if (far_interval.x <= far_interval.y) {
            search(far, far_interval, state);
        } else {
            state.phase = CLIMB;
        }
    }
}

void intersect(Ray ray, inout State state, inout Hit hit) {
    test_triangle(ray, reference_triangle(state.cursor), hit);
    bool ends = list_ends(state);
    if (search_over(hit)) {
        state.phase = DONE;
    } else if (ends) {
        leave_leaf(state, hit);
    }
}

// Continue at the far sibling of a near child if the ray meets the sibling's box, else climb to the parent.
void climb(Ray ray, inout State state, inout Hit hit) {
    COUNT(nodes_visited);
    pointer node = state.node;
    int side = unit_bounds_side(node);
    if (side == ROOT) {
        state.phase = DONE;
    } else {
        bool right = side >= LEAF;
        pointer sibling = moved(node, right ? -1 : 1);
        vec2 interval = interval_in(ray, sibling);
        interval = vec2(max(interval.x, ray.t_min), min(interval.y, ray.t_max));
        bool meets = interval.x <= interval.y && interval.x <= hit.t;
        if (right == goes_down(ray, right ? side - LEAF : side) && meets) {
            search(sibling, interval, state);
        } else {
            state.node = unit_bounds_parent(node);
        }
    }
}
