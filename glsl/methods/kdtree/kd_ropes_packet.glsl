// kd-ropes-packet: Popov, Günther, Seidel, Slusallek, "Stackless KD-Tree Traversal for High Performance GPU
// Ray Tracing", Eurographics 2007 (survey, section 3.4, Figure 16). Each ray of a packet has its own node
// and its own t. The packet fetches one node at a time; rays at other nodes wait. A rope of a leaf leads to
// the node behind a face of the leaf. Unlike in kd-ropes, ropes are not pushed down by default. So the node
// is the root of a whole sibling subtree, where rays from different leaves meet again.
//
// The packet next visits the node of the ray with the smallest t, so that the rays behind catch up. Rays
// that meet the same leaf then usually share the leaf's fetch and tests.
//
// Departure: only rays whose directions have equal signs share a walk, which is called a turn
// (drivers/packet_turns.glsl). So all rays of a turn can leave a box only by the same three faces. An
// option chooses the file behind <triangle_tests> (drivers/triangle_by_ray.glsl or triangle_by_axes.glsl).

#define PRESENT(r) (ray_node[r] == node)

#include "methods/kdtree/ropes.glsl"
#include "drivers/packet_turns.glsl"

const int SETTLED = 1 << 24;   // the ray visits no node; larger than every node, so `min` ignores it

float t_min[RAYS];
int ray_node[RAYS];
int node;

#include <triangle_tests>

bool is_settled(int r) {
    return ray_node[r] == SETTLED && t_turn[r] == NEVER;
}

void start_ray(int r) {
    Ray ray = rays[r];
    vec2 interval = box_interval(ray, scene_lo, scene_hi);
    t_min[r] = max(interval.x, ray.t_min);
    bool enters = t_min[r] <= min(interval.y, ray.t_max) && ray.t_min <= ray.t_max;
    octant[r] = direction_octant(ray.inv_dir) + shared_axis(ray);
    t_turn[r] = enters ? t_min[r] : NEVER;
    ray_node[r] = SETTLED;
}

void take_turn(int r) {
    bool comes = t_turn[r] != NEVER && octant[r] == turn;
    ray_node[r] = comes ? 0 : ray_node[r];
    t_turn[r] = comes ? NEVER : t_turn[r];
}

float t_front;   // the smallest t_min of the rays

void find_front(int r) {
    t_front = ray_node[r] == SETTLED ? t_front : min(t_front, t_min[r]);
}

void choose_node(int r) {
    node = t_min[r] == t_front ? min(node, ray_node[r]) : node;
}

void find_t_front() {
    t_front = INFINITE;
    EACH(find_front)
}

// Choose the next node. Return false when all rays of the turn are settled.
bool next_node() {
    node = SETTLED;
    find_t_front();
    EACH(choose_node)
    return node != SETTLED;
}

void start_packet() {
    EACH(start_ray)
}

void begin_turn() {
    EACH(take_turn)
    EACH(find_start)
    next_node();
}

float plane;
int axis;
int left;
int next;
int near;
int far;

void split_ray(int r) {
    bool takes_far = plane_t(rays[r], axis, plane) <= t_min[r];
    int child = takes_far ? far : near;
    bool here = ray_node[r] == node;
    ray_node[r] = here ? child : ray_node[r];
    next = here && t_min[r] == t_front ? min(next, child) : next;
}

// Visit an inner node. Each ray at the node moves to a child; the packet moves to the child of the ray with
// the smallest t.
void enter() {
    COUNT(nodes_visited);
    ++steps;
    plane = kd_node_split(node);
    next = SETTLED;
    near = left + (turn >> axis & 1);
    far = left + (~turn >> axis & 1);
    EACH(split_ray)
    node = next;
}

vec3 faces;
Ropes ropes;

void follow_rope(int r) {
    vec3 exits = planes_t(rays[r], faces);
    float t_leave = min_component(exits);
    int rope = rope_taken(exits, t_leave, ropes);
    // Without a hit, hit.t is the ray's t_max.
    bool settled = hits[r].t < t_leave || rope < 0 || search_over(hits[r]);
    bool here = ray_node[r] == node;
    ray_node[r] = here ? (settled ? SETTLED : rope) : ray_node[r];
    t_min[r] = here ? max(t_min[r], t_leave) : t_min[r];
}

// Follow the ropes of the rays in the leaf. Return false when the rays of the turn have
// finished.
bool leave_leaf() {
    int leaf = axis - LEAF;
    bvec3 down = notEqual(ivec3(turn) & ivec3(1, 2, 4), ivec3(0));
    faces = faces_ahead(leaf, down);
    ropes = ropes_ahead(leaf, down);
    EACH(follow_rope)
    return next_node();
}

// Descend to a leaf, test its triangles, and let its rays follow their ropes. Return false when the rays of
// the turn have finished, or at the step limit.
bool step_packet() {
    axis = kd_node_axis(node);
    left = kd_node_left(node);
    if (axis < LEAF && steps < step_limit) {
        do {
            enter();
            axis = kd_node_axis(node);
            left = kd_node_left(node);
        } while (axis < LEAF && steps < step_limit);
    }
    if (axis < LEAF) {   // out of steps
        return false;
    }
    COUNT(nodes_visited);
    COUNT(leaves_visited);
    ++steps;
    int end = left + kd_node_count(node);
    if (left < end) {
        do {
            tested = reference_triangle(left);
            test_rays();
            ++left;
            ++steps;
        } while (left < end && steps < step_limit);
    }
    if (left < end) {
        return false;
    }
    return leave_leaf();
}
