// kd-packet: Horn, Sugerman, Houston, Hanrahan, "Interactive k-D Tree GPU Raytracing", I3D 2007
// (survey, section 3.4, Figures 13 and 14). The rays of a packet share the node and its fetch; each
// keeps its interval. A node is entered if any ray needs it, and the far child is kept where any
// needs both. STACK_SIZE and PUSH_DOWN as in kd-short-stack and kd-push-down; a stack of 0 restarts.
//
// Rays whose directions have other signs, or another dominant axis where rays share the triangle's
// axes (packet_axes.glsl), wait, masked by an empty interval. With VERTEX_CULLING rays test
// only those triangles of a leaf that the packet's frustum does not rule out.

#define PRESENT(r) (t_min[r] < t_exit[r])
#ifdef INTERSECTION_WOOP_WATERTIGHT
#define SHARED_AXES
#endif

#include "methods/kdtree/kd.glsl"
#include "drivers/packet_turns.glsl"

float t_min[RAYS];
float t_max[RAYS];
float t_exit[RAYS];
float t_split[RAYS];

int node;
int pushed;                   // a restart begins here
bool pushing;
bool any_near;
bool any_far;
bool any_awake;
bool any_left;

#if STACK_SIZE > 0
int stacked;
int stack_node[STACK_SIZE];
float stack_t_max[STACK_SIZE * RAYS];
#endif

#include "drivers/packet_axes.glsl"
#ifdef VERTEX_CULLING
#include "drivers/vertex_culling.glsl"
#endif

bool is_settled(int r) {
    return t_min[r] >= t_exit[r] && t_turn[r] == NEVER;
}

void start_ray(int r) {
    Ray ray = rays[r];
    vec2 interval = box_interval(ray, scene_lo, scene_hi);
    float start = max(interval.x, ray.t_min);
    t_exit[r] = min(max(box_exit(ray, scene_lo, scene_hi), start), ray.t_max);
    // An interval of one point is widened: a ray is awake in a node where it has a length.
    t_exit[r] = max(t_exit[r], start + abs(start) * (4.0 * ARITHMETIC_UNIT) + 1e-30);
    octant[r] = direction_octant(ray.inv_dir) + shared_axis(ray);
    t_turn[r] = start <= min(interval.y, ray.t_max) && ray.t_min <= ray.t_max ? start : NEVER;
    t_min[r] = NEVER;
    t_max[r] = 0.0;
}

void take_turn(int r) {
    bool comes = octant[r] == turn;
    t_min[r] = comes ? t_turn[r] : t_min[r];
    t_max[r] = t_exit[r];
    t_turn[r] = comes ? NEVER : t_turn[r];
}

// From the root.
void begin_turn() {
    EACH(take_turn)
#ifdef SHARED_AXES
    EACH(find_start)
#endif
#ifdef VERTEX_CULLING
    bound_frustum();
#endif
    node = 0;
    pushed = 0;
    pushing = true;
#if STACK_SIZE > 0
    stacked = 0;
#endif
}

void start_packet() {
    EACH(start_ray)
}

// Descent ----------------------------------------------------------------------------------------

float plane;
int axis;
bool near_is_empty;
bool far_is_empty;

void split_ray(int r) {
    t_split[r] = plane_t(rays[r], axis, plane);
    bool awake = t_min[r] < t_max[r];
    bool near = awake && t_split[r] > t_min[r];
    bool far = awake && t_split[r] < t_max[r];
    t_min[r] = near && near_is_empty ? smaller(t_split[r], t_max[r])
             : far && !near && far_is_empty ? t_max[r] : t_min[r];
    any_near = any_near || (near && !near_is_empty);
    any_far = any_far || (far && !far_is_empty);
}

// The interval in the near child; empty for a ray that needs the far one alone.
void cut_ray(int r) {
    t_max[r] = smaller(t_split[r], t_max[r]);
}

#if STACK_SIZE > 0
void push_ray(int r) {
    for (int k = STACK_SIZE - 1; k > 0; --k) {
        stack_t_max[k * RAYS + r] = stack_t_max[(k - 1) * RAYS + r];
    }
    stack_t_max[r] = t_max[r];
}

void push(int far) {
    EACH(push_ray)
    for (int k = STACK_SIZE - 1; k > 0; --k) {
        stack_node[k] = stack_node[k - 1];
    }
    stack_node[0] = far;
    stacked = min(stacked + 1, STACK_SIZE);
}

void pop_ray(int r) {
    t_max[r] = stack_t_max[r];
    for (int k = 1; k < STACK_SIZE; ++k) {
        stack_t_max[(k - 1) * RAYS + r] = stack_t_max[k * RAYS + r];
    }
    any_awake = any_awake || t_min[r] < t_max[r];
}

void pop() {
    node = stack_node[0];
    for (int k = 1; k < STACK_SIZE; ++k) {
        stack_node[k - 1] = stack_node[k];
    }
    --stacked;
    EACH(pop_ray)
}
#endif

// `empty` tells which children are leaves without triangles, 1 the left and 2 the right one: rays
// pass through these at once. False when no ray needs a child.
bool enter(int left, int empty) {
    int negative = (turn >> axis) & 1;
    int near = left + negative;
    int far = left + 1 - negative;
    near_is_empty = (empty & (1 + negative)) != 0;
    far_is_empty = (empty & (2 - negative)) != 0;
    any_near = any_far = false;
    EACH(split_ray)
    node = any_near ? near : far;
    if (any_near) {
#if STACK_SIZE > 0
        if (any_far) {
            push(far);
        }
#endif
        EACH(cut_ray)
    }
    pushing = pushing && !(any_near && any_far);
#ifdef PUSH_DOWN
    pushed = pushing ? node : pushed;
#endif
    return any_near || any_far;
}

// Leaves -----------------------------------------------------------------------------------------

// A hit before the leaf's end settles a ray, as does the end of its interval.
void leave_ray(int r) {
    bool awake = t_min[r] < t_max[r];
    t_min[r] = awake ? (hits[r].t < t_max[r] ? NEVER : t_max[r]) : t_min[r];
#ifdef ANY_HIT
    if (search_over(hits[r])) {
        t_min[r] = NEVER;
        t_turn[r] = NEVER;
    }
#endif
    any_left = any_left || t_min[r] < t_exit[r];
}

void restart_ray(int r) {
    t_max[r] = t_exit[r];
}

// Down to a leaf, through its triangles, and on to the next node; false when the rays whose turn
// it is are through.
bool step_packet() {
    axis = kd_node_axis(node);
    int left = kd_node_left(node);
    int count = kd_node_count(node);
    bool needed = true;
    if (axis < LEAF) {
        do {
            COUNT(nodes_visited);
            ++steps;
            plane = kd_node_split(node);
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
#ifdef VERTEX_CULLING
            bool outside = culled(tested);
            while (outside && left + 1 < end) {
                ++left;
                tested = reference_triangle(left);
                outside = culled(tested);
            }
            if (!outside) {
                test_rays();
            }
#else
            test_rays();
#endif
            ++left;
            ++steps;
        } while (left < end && steps < step_limit);
        if (left < end) {
            return false;
        }
    }
    any_left = false;
    EACH(leave_ray)
    any_awake = false;
#if STACK_SIZE > 0
    if (any_left && stacked > 0) {
        do {
            pop();
        } while (!any_awake && stacked > 0);
    }
#endif
    if (any_left && !any_awake) {
        node = pushed;
        pushing = true;
        EACH(restart_ray)
    }
    return any_left;
}
