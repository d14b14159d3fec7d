// bvh-packet: Guenther, Popov, Seidel, Slusallek, "Realtime Ray Tracing on GPU with BVH-based Packet
// Traversal", RT 2007 (survey, section 3.5, Figure 22). The rays of a packet share one node pointer
// and one stack. Each ray tests both children's boxes; a child is entered if any ray is in it, and
// where both are, the one that more rays meet first comes first, the other goes on the stack.
//
// Departures: the packet is a fragment's, not a warp's, so votes are sums and not reductions in shared
// memory. bvh-stack is this file with packets of one ray. With INTERVAL_TEST a box is tested once a
// packet (packet_bounds.glsl). With OCTANTS there is no stack: the packet walks the threaded copy of
// the tree (Thrane and Simonsen 2005) for its rays' direction octant.

#include "common/quantised.glsl"
#include "common/packet_turns.glsl"
#include "common/packet_bounds.glsl"

#if defined(OCTANTS) || defined(INTERVAL_TEST)
#define TURNS   // the rays that go together agree in the signs of their directions
#endif

uniform int node_count;

bool through = false;   // the walk of the present rays has ended
bool any_in;
bool any_left;
vec3 lo;
vec3 hi;

bool is_settled(int r) {
    return t_turn[r] == NEVER && (through || rays[r].t_min == NEVER);
}

void start_ray(int r) {
    Ray ray = rays[r];
#ifdef TURNS
    octant[r] = direction_octant(ray.direction);
#else
    octant[r] = 0;
#endif
    t_turn[r] = node_count > 0 && ray.t_min <= ray.t_max ? ray.t_min : NEVER;
    rays[r].t_min = NEVER;
}

void start_packet() {
    EACH(start_ray)
}

void take_turn(int r) {
    bool comes = octant[r] == turn;
    rays[r].t_min = comes ? t_turn[r] : through ? NEVER : rays[r].t_min;
    t_turn[r] = comes ? NEVER : t_turn[r];
}

void start_walk();

// The rays that go together next, from the root; false when there are none.
bool next_turn() {
    turn = -1;
    EACH(find_turn)
    if (turn >= 0) {
        EACH(take_turn)
#ifdef INTERVAL_TEST
        bound_rays();
#endif
        start_walk();
        through = false;
    }
    return turn >= 0;
}

// Leaves -----------------------------------------------------------------------------------------

// A ray that found any hit is settled.
void leave_ray(int r) {
    rays[r].t_min = search_over(hits[r]) ? NEVER : rays[r].t_min;
    any_left = any_left || rays[r].t_min < NEVER;
}

// The triangles of a leaf; false when no ray has anything left to find, or steps ran out.
bool intersect(int first) {
    COUNT(leaves_visited);
    int next = first;
    do {
        tested = next;
        EACH(test_ray)
        next = triangle_last(tested) != 0 ? -1 : tested + 1;
        ++steps;
    } while (next >= 0 && steps < step_limit);
    any_left = true;
#ifdef ANY_HIT
    any_left = false;
    EACH(leave_ray)
#endif
#ifdef INTERVAL_TEST
    bound_hits();
#endif
    return any_left && next < 0;
}

#ifdef OCTANTS

// Along escape indices ---------------------------------------------------------------------------

#include "common/bvh_nodes.glsl"

int node;

void start_walk() {
    node = turn * node_count;
}

void test_box(int r) {
    vec2 interval = box_interval(rays[r], lo, hi);
    any_in = any_in || max(interval.x, rays[r].t_min) <= min(interval.y, hits[r].t);
}

// To the next leaf that a ray is in, and through its triangles; false when the rays whose turn it
// is are through, or out of steps.
bool step_packet() {
    // Carried from turn to turn of the loop: llvmpipe loses what only the last one computed, for
    // packets that leave it before others do.
    int leaf = -1;
    do {
        COUNT(nodes_visited);
        ++steps;
        lo = bvh_node_lo(node);
        hi = bvh_node_hi(node);
        int first = bvh_node_first(node);
#ifdef INTERVAL_TEST
        vec2 interval = bounding_interval(lo, hi);
        any_in = interval.x <= interval.y;
#else
        any_in = false;
        EACH(test_box)
#endif
        leaf = any_in ? first : -1;
        node = any_in && first < 0 ? node + 1 : bvh_node_escape(node);
    } while (leaf < 0 && node >= 0 && steps < step_limit);
    bool on = true;
    if (leaf >= 0) {
        on = intersect(leaf);
        through = !any_left;
    }
    through = through || (node < 0 && on);
    return on && node >= 0 && steps < step_limit;
}

#else

// With a stack -----------------------------------------------------------------------------------

#include "common/bvh_pairs.glsl"

int stack[STACK_SIZE];
int stacked;
int child;

void start_walk() {
    child = root;
    stacked = 0;
}

vec3 right_lo;
vec3 right_hi;
bool any_right;
int for_left;     // how many more rays meet the left child first

void test_boxes(int r) {
    vec2 left = box_interval(rays[r], lo, hi);
    vec2 right = box_interval(rays[r], right_lo, right_hi);
    left.x = max(left.x, rays[r].t_min);
    right.x = max(right.x, rays[r].t_min);
    bool in_left = left.x <= min(left.y, hits[r].t);
    bool in_right = right.x <= min(right.y, hits[r].t);
    any_in = any_in || in_left;
    any_right = any_right || in_right;
    bool left_first = in_left && (!in_right || left.x <= right.x);
    for_left += left_first ? 1 : (in_right ? -1 : 0);
}

// Down to a leaf, through its triangles, and on to what the stack holds; false when that is
// nothing, or out of steps.
bool step_packet() {
    bool on = true;
    while (!is_leaf(child) && on && steps < step_limit) {
        COUNT(nodes_visited);
        ++steps;
        lo = bvh_pair_left_lo(child);
        hi = bvh_pair_left_hi(child);
        right_lo = bvh_pair_right_lo(child);
        right_hi = bvh_pair_right_hi(child);
        int left = bvh_pair_left(child);
        int right = bvh_pair_right(child);
#ifdef INTERVAL_TEST
        vec2 in_left = bounding_interval(lo, hi);
        vec2 in_right = bounding_interval(right_lo, right_hi);
        any_in = in_left.x <= in_left.y;
        any_right = in_right.x <= in_right.y;
        for_left = in_left.x <= in_right.x ? 1 : -1;
#else
        any_in = any_right = false;
        for_left = 0;
        EACH(test_boxes)
#endif
        if (any_in && any_right) {
            stack[stacked] = for_left >= 0 ? right : left;
            ++stacked;
            child = for_left >= 0 ? left : right;
        } else if (any_in || any_right) {
            child = any_in ? left : right;
        } else if (stacked > 0) {
            --stacked;
            child = stack[stacked];
        } else {
            on = false;
        }
    }
    through = !on;
    if (on && is_leaf(child)) {
        on = intersect(first_triangle(child));
        through = !any_left || (on && stacked == 0);
        if (stacked > 0) {
            --stacked;
            child = stack[stacked];
        } else {
            on = false;
        }
    }
    return on && !through && steps < step_limit;
}

#endif
