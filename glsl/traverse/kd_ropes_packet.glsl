// kd-ropes-packet: Popov, Günther, Seidel, Slusallek, "Stackless KD-Tree Traversal for High
// Performance GPU Ray Tracing", Eurographics 2007 (survey, section 3.4, Figure 16). The rays of a
// packet share the node that is fetched; each has a node and a t of its own, and those that are
// elsewhere wait. Ropes are not pushed down: a leaf's rope names the root of the sibling subtree,
// where rays that left by different leaves meet again.
//
// The next node is the smallest that any ray is at: nodes are numbered level by level, so the rays
// that are highest in the tree come down first and join the others.
//
// Departure: rays with another dominant axis take turns where rays share the triangle's axes
// (packet_axes.glsl), and only those that are at a leaf are tested there.

#define PRESENT(r) (ray_node[r] == node)
#ifdef INTERSECTION_WOOP_WATERTIGHT
#define SHARED_AXES
#endif

#include "common/kd.glsl"
#include "common/packet_turns.glsl"

const int SETTLED = 1 << 24;   // a node above every index

float t_min[RAYS];
float t_exit[RAYS];
int ray_node[RAYS];
int node;

#include "common/packet_axes.glsl"

bool is_settled(int r) {
    return ray_node[r] == SETTLED && t_turn[r] == NEVER;
}

void start_ray(int r) {
    Ray ray = rays[r];
    vec2 interval = box_interval(ray, scene_lo, scene_hi);
    t_min[r] = max(interval.x, ray.t_min);
    t_exit[r] = min(max(box_exit(ray, scene_lo, scene_hi), t_min[r]), ray.t_max);
    bool enters = t_min[r] <= min(interval.y, ray.t_max) && ray.t_min <= ray.t_max;
    octant[r] = shared_axis(ray);
    t_turn[r] = enters ? t_min[r] : NEVER;
    ray_node[r] = SETTLED;
}

void take_turn(int r) {
    bool comes = t_turn[r] != NEVER && octant[r] == turn;
    ray_node[r] = comes ? 0 : ray_node[r];
    t_turn[r] = comes ? NEVER : t_turn[r];
}

void choose_node(int r) {
    node = min(node, ray_node[r]);
}

bool next_node() {
    node = SETTLED;
    EACH(choose_node)
    return node != SETTLED;
}

void start_packet() {
    EACH(start_ray)
}

// The rays of the next dominant axis, from the root; false when there are none.
bool next_turn() {
    turn = -1;
    EACH(find_turn)
    EACH(take_turn)
#ifdef SHARED_AXES
    EACH(find_start)
#endif
    node = 0;
    return turn >= 0;
}

float plane;
int axis;
int left;

void split_ray(int r) {
    bool takes_far = plane_t(rays[r], axis, plane) <= t_min[r];
    bool negative = along(axis, rays[r].inv_dir) < 0.0;
    int child = left + int(takes_far != negative);
    ray_node[r] = ray_node[r] == node ? child : ray_node[r];
}

vec3 leaf_lo;
vec3 leaf_hi;
ivec3 ropes_lo;
ivec3 ropes_hi;

void follow_rope(int r) {
    vec3 exits = box_exits(rays[r], leaf_lo, leaf_hi);
    float t_leave = min_component(exits);
    int rope = rope_behind(rays[r], exits, ropes_lo, ropes_hi);
    bool settled = hits[r].t < t_leave || t_leave >= t_exit[r] || rope < 0
                || search_over(hits[r]);
    bool here = ray_node[r] == node;
    ray_node[r] = here ? (settled ? SETTLED : rope) : ray_node[r];
    t_min[r] = here ? max(t_min[r], t_leave) : t_min[r];
}

// Down to a leaf, through its triangles, and along the ropes of the rays that are there.
bool step_packet() {
    axis = kd_node_axis(node);
    left = kd_node_left(node);
    if (axis < LEAF && steps < step_limit) {
        do {
            COUNT(nodes_visited);
            ++steps;
            plane = kd_node_split(node);
            EACH(split_ray)
            next_node();
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
    int leaf = axis - LEAF;
    leaf_lo = kd_leaf_lo(leaf);
    leaf_hi = kd_leaf_hi(leaf);
    ropes_lo = ivec3(kd_leaf_rope_lo_x(leaf), kd_leaf_rope_lo_y(leaf), kd_leaf_rope_lo_z(leaf));
    ropes_hi = ivec3(kd_leaf_rope_hi_x(leaf), kd_leaf_rope_hi_y(leaf), kd_leaf_rope_hi_z(leaf));
    EACH(follow_rope)
    return next_node();
}
