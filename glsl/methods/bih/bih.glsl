// bih: Waechter and Keller, "Instant Ray Tracing: The Bounding Interval Hierarchy", EGSR 2006 (survey,
// section 4.4). The two planes of a node say where the left child ends and where the right child begins.
// The children may overlap or leave a gap, so a ray enters both children, one child or neither.
//
// Departure: the paper uses a stack, which a fragment program of 2006 does not have. As in Foley and
// Sugerman's kd-backtrack, a ray climbs to one parent per step, and enters each far child whose box the ray
// meets. This box is the scene's box, cut by the planes of the child's ancestors. The same expression gives
// the t of a plane in the descent and in the test of this box. So the test finds the interval that a stack
// would have stored.
//
// With STACK_SIZE above 0, far children wait on a stack, a local array. Entries can be lost: the array is
// empty at the start of each pass, and a push onto a full stack drops the lowest entry. If a ray's stack is
// empty and entries were lost, the ray climbs. So all stack sizes and all schedules give the same hits.
//
// Planes are shifted outward, like the faces of boxes (core/slack.glsl). Planes that end a child are
// measured from hi_origin. Planes that begin a child are measured from lo_origin.

#include "core/axis.glsl"

uniform int node_count;

#if STACK_SIZE > 0
bool stack_whole = false;   // whether no entry of this ray was lost
int stack_top = 0;
int stacked = 0;
int stack_node[STACK_SIZE];
vec2 stack_interval[STACK_SIZE];
#endif

void init(Ray ray, out State state) {
    vec2 interval = box_interval(ray, scene_lo, scene_hi);
    state.t_min = max(interval.x, ray.t_min);
    state.t_max = min(interval.y, ray.t_max);
    state.node = 0;
    state.cursor = 0;
    state.phase = node_count > 0 && state.t_min <= state.t_max ? DOWN : DONE;
#if STACK_SIZE > 0
    stack_whole = true;
#endif
}

void push(int node, vec2 interval) {
#if STACK_SIZE > 0
    stack_whole = stack_whole && stacked < STACK_SIZE;
    stack_node[stack_top] = node;
    stack_interval[stack_top] = interval;
    stack_top = stack_top + 1 == STACK_SIZE ? 0 : stack_top + 1;
    stacked = min(stacked + 1, STACK_SIZE);
#endif
}

void down(Ray ray, inout State state, inout Hit hit) {
    COUNT(nodes_visited);
    int node = state.node;
    int axis = bih_node_axis(node);
    int child = bih_node_child(node);
    if (axis == LEAF) {
        COUNT(leaves_visited);
        state.cursor = child;
        state.phase = INTERSECT;
    } else {
        float d = along(axis, ray.inv_dir);
        float t_left = R(R(bih_node_left_hi(node) - along(axis, ray.hi_origin)) * d);
        float t_right = R(R(bih_node_right_lo(node) - along(axis, ray.lo_origin)) * d);
        bool backwards = d < 0.0;
        float t_max = min(state.t_max, hit.t);
        float near_t_max = min(t_max, backwards ? t_right : t_left);
        float far_t_min = max(state.t_min, backwards ? t_left : t_right);
        bool enters_near = state.t_min <= near_t_max;
        bool enters_far = far_t_min <= t_max;
        int far = backwards ? child : child + 1;
        if (enters_near) {
            if (enters_far) {
                push(far, vec2(far_t_min, t_max));
            }
            state.node = backwards ? child + 1 : child;
            state.t_max = near_t_max;
        } else if (enters_far) {
            state.node = far;
            state.t_min = far_t_min;
            state.t_max = t_max;
        } else {
            state.phase = CLIMB;
        }
    }
}

void intersect(Ray ray, inout State state, inout Hit hit) {
    int i = state.cursor;
    test_triangle(ray, i, hit);
    ++state.cursor;
    if (search_over(hit)) {
        state.phase = DONE;
    } else if (triangle_last(i) != 0) {
        state.phase = CLIMB;
    }
}

// Continue at the far sibling if the node is a near child and the ray meets the sibling's box. Otherwise
// climb to the parent.
void climb_to_parent(Ray ray, inout State state, Hit hit) {
    int node = state.node;
    int side = bih_bounds_side(node);
    if (side == ROOT) {
        state.phase = DONE;
        return;
    }
    bool right = side >= 3;
    bool backwards = along(right ? side - 3 : side, ray.inv_dir) < 0.0;
    int sibling = right ? node - 1 : node + 1;
    vec2 interval = box_interval(ray, bih_bounds_lo(sibling), bih_bounds_hi(sibling));
    float t_min = max(interval.x, ray.t_min);
    float t_max = min(interval.y, hit.t);
    if (right == backwards && t_min <= t_max) {
        state.node = sibling;
        state.t_min = t_min;
        state.t_max = t_max;
        state.phase = DOWN;
    } else {
        state.node = bih_bounds_parent(node);
    }
}

void climb(Ray ray, inout State state, inout Hit hit) {
#if STACK_SIZE > 0
    if (stacked > 0) {
        stack_top = (stack_top == 0 ? STACK_SIZE : stack_top) - 1;
        --stacked;
        vec2 interval = stack_interval[stack_top];
        state.node = stack_node[stack_top];
        state.t_min = interval.x;
        state.t_max = min(interval.y, hit.t);
        state.phase = state.t_min <= state.t_max ? DOWN : CLIMB;
        return;
    }
    if (stack_whole) {
        state.phase = DONE;
        return;
    }
#endif
    COUNT(nodes_visited);
    climb_to_parent(ray, state, hit);
}
