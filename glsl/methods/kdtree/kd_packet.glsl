// kd-packet: Horn, Sugerman, Houston, Hanrahan, "Interactive k-D Tree GPU Raytracing", I3D 2007 (survey,
// section 3.4, Figures 13 and 14). The rays of a packet share the node and its fetch. Each ray has its own
// interval. The packet enters a child if any ray needs the child. If rays need both children, the packet
// enters the near child and pushes the far child. A restart begins at the root, or, with PUSH_DOWN, at the
// deepest node that contains the unsearched part of every ray's interval (kd_push_down.glsl).
//
// Addition: with SKIP_EMPTY_LEAVES a packet does not fetch a leaf whose parent marks the leaf as empty. The
// survey does not say that Horn et al. do so.
//
// The packet traverses in turns (drivers/packet_turns.glsl): the rays of a turn agree in the signs of their
// directions. All other rays wait, masked by an empty interval. Options choose the files behind
// <triangle_tests> (drivers/triangle_by_ray.glsl or triangle_by_axes.glsl), <culling> and <short_stack>.

#define PRESENT(r) (t_min[r] < t_exit[r])

#include "methods/kdtree/kd.glsl"
#include "drivers/packet_turns.glsl"

float t_min[RAYS];
float t_max[RAYS];
float t_exit[RAYS];
float t_split[RAYS];

int node;
int pushed;                   // the node at which a restart begins
bool pushing;                 // whether no far child was pushed since the last start or restart
bool any_near;
bool any_far;
bool any_awake;
bool any_left;

#include <triangle_tests>
#include <culling>
#include <short_stack>

bool is_settled(int r) {
    return t_min[r] >= t_exit[r] && t_turn[r] == NEVER;
}

void start_ray(int r) {
    Ray ray = rays[r];
    vec2 interval = box_interval(ray, scene_lo, scene_hi);
    float start = max(interval.x, ray.t_min);
    t_exit[r] = min(max(box_exit(ray, scene_lo, scene_hi), start), ray.t_max);
    // A ray is awake in a node if its interval in the node is longer than 0. Widen the interval, so that a
    // ray stays awake even if its interval is a single point.
    t_exit[r] = max(t_exit[r], start + abs(start) * (4.0 * ARITHMETIC_UNIT) + 1e-30);
    octant[r] = direction_octant(ray.inv_dir) + shared_axis(ray);
    t_turn[r] = start <= min(interval.y, ray.t_max) && ray.t_min <= ray.t_max ? start : NEVER;
    t_min[r] = NEVER;
    t_max[r] = 0.0;
}

void start_packet() {
    EACH(start_ray)
}

void take_turn(int r) {
    bool comes = octant[r] == turn;
    t_min[r] = comes ? t_turn[r] : t_min[r];
    t_max[r] = t_exit[r];
    t_turn[r] = comes ? NEVER : t_turn[r];
}

// Begin the search of a turn at the root.
void begin_turn() {
    EACH(take_turn)
    EACH(find_start)
    bound_frustum();
    node = 0;
    pushed = 0;
    pushing = true;
    clear_stack();
}

// Descent ----------------------------------------------------------------------------------------

float plane;
int axis;
int near;
int far;
bool near_is_empty;     // whether the child is known to be an empty leaf; false without SKIP_EMPTY_LEAVES
bool far_is_empty;

// Split the interval of a ray at the plane. If the child at t_min is known to be an empty leaf, the ray
// skips this leaf: t_min moves to the end of the ray's interval in the leaf.
void split_ray(int r) {
    t_split[r] = plane_t(rays[r], axis, plane);
    bool awake = t_min[r] < t_max[r];
    bool in_near = awake && t_split[r] > t_min[r];
    bool in_far = awake && t_split[r] < t_max[r];
    t_min[r] = in_near && near_is_empty ? smaller(t_split[r], t_max[r])
             : in_far && !in_near && far_is_empty ? t_max[r] : t_min[r];
    any_near = any_near || (in_near && !near_is_empty);
    any_far = any_far || (in_far && !far_is_empty);
}

// Cut the interval to the near child. If a ray needs only the far child, its interval becomes empty.
void cut_ray(int r) {
    t_max[r] = smaller(t_split[r], t_max[r]);
}

// Order the children along the rays. `empty` says which children are leaves without triangles: 1 for the
// left child, 2 for the right child, 3 for both.
void order_children(int left, int empty) {
    int negative = (turn >> axis) & 1;
    near = left + negative;
    far = left + 1 - negative;
#ifdef SKIP_EMPTY_LEAVES
    near_is_empty = (empty & (1 + negative)) != 0;
    far_is_empty = (empty & (2 - negative)) != 0;
#else
    near_is_empty = far_is_empty = false;
#endif
}

// Move on to the near child if any ray needs it, else to the far child. Return false if no ray needs a
// child.
bool move_on() {
    node = any_near ? near : far;
    if (any_near) {
        if (any_far) {
            push(far);
        }
        EACH(cut_ray)
    }
    pushing = pushing && !(any_near && any_far);
#ifdef PUSH_DOWN
    pushed = pushing ? node : pushed;
#endif
    return any_near || any_far;
}

// Visit an inner node and move on to a child. Return false if no ray needs a child.
bool enter(int left, int empty) {
    COUNT(nodes_visited);
    ++steps;
    plane = kd_node_split(node);
    order_children(left, empty);
    any_near = any_far = false;
    EACH(split_ray)
    return move_on();
}

// Leaves -----------------------------------------------------------------------------------------

// Settle a ray that has a hit before the leaf's end, or whose interval ends with the leaf. Every other ray
// of the leaf continues at the leaf's end.
void leave_ray(int r) {
    bool awake = t_min[r] < t_max[r];
    t_min[r] = awake ? (hits[r].t < t_max[r] ? NEVER : t_max[r]) : t_min[r];
    if (search_over(hits[r])) {
        t_min[r] = NEVER;
        t_turn[r] = NEVER;
    }
    any_left = any_left || t_min[r] < t_exit[r];
}

void restart_ray(int r) {
    t_max[r] = t_exit[r];
}

// Pop the next node after a leaf, or restart. Return false when the rays of the turn have
// finished.
bool leave_leaf() {
    any_left = false;
    EACH(leave_ray)
    any_awake = false;
    pop_awake();
    if (any_left && !any_awake) {
        node = pushed;
        pushing = true;
        EACH(restart_ray)
    }
    return any_left;
}

// Descend to a leaf, test its triangles, and continue at the next node. Return false when the rays of the
// turn have finished, or at the step limit.
bool step_packet() {
    axis = kd_node_axis(node);
    int left = kd_node_left(node);
    int count = kd_node_count(node);
    bool needed = true;
    if (axis < LEAF) {
        do {
            needed = enter(left, count);
            axis = kd_node_axis(node);
            left = kd_node_left(node);
            count = kd_node_count(node);
        } while (needed && axis < LEAF && steps < step_limit);
    }
    if (axis < LEAF && needed) {   // out of steps
        return false;
    }
    int end = left + count;
    if (needed) {
        COUNT(nodes_visited);
        COUNT(leaves_visited);
        ++steps;
    }
    if (needed && count > 0) {
        do {
            tested = reference_triangle(left);
            bool outside = culled(tested);
            while (outside && left + 1 < end) {
                ++left;
                tested = reference_triangle(left);
                outside = culled(tested);
            }
            if (!outside) {
                test_rays();
            }
            ++left;
            ++steps;
        } while (left < end && steps < step_limit);
        if (left < end) {
            return false;
        }
    }
    return leave_leaf();
}
