// bvh-packet: Günther, Popov, Seidel, Slusallek, "Realtime Ray Tracing on GPU with BVH-based Packet
// Traversal", RT 2007 (survey, section 3.5, Figure 22). The rays of a packet share one node pointer
// and one stack. Each ray tests both children's boxes; a child is entered if any ray is in it, and
// where both are, the one that more rays meet first comes first, the other goes on the stack.
//
// Departures: the packet is a fragment's, not a warp's, so votes are sums and not reductions in shared
// memory. bvh-stack is this file with packets of one ray. With INTERVAL_TEST a box is tested once a
// packet (packet_bounds.glsl). With OCTANTS there is no stack: the packet walks the threaded copy of
// the tree (Thrane and Simonsen 2005) for its rays' direction octant; with SHARED_SUBTREES what stands
// low in the tree is no copy (methods/bvh/shared_subtrees.glsl). With VERTEX_CULLING the rays
// test only those triangles of a leaf that the packet's frustum does not rule out. With ENTRY_TILE a
// packet begins where a beam ahead of it found (drivers/packet_entry.glsl). In `loop` a
// walk from one leaf to the next pauses after BOXES boxes, whether it has found one or not.

#define PRESENT(r) (rays[r].t_min < NEVER)
#if defined(INTERSECTION_WOOP_WATERTIGHT) && !defined(STEPWISE)
#define SHARED_AXES
#endif

#include "core/quantised.glsl"
#include "drivers/packet_turns.glsl"
#include "drivers/packet_axes.glsl"
#include "drivers/packet_bounds.glsl"
#ifdef VERTEX_CULLING
#include "drivers/vertex_culling.glsl"
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
    octant[r] = octant_of(ray);
    t_turn[r] = node_count > 0 && ray.t_min <= ray.t_max ? ray.t_min : NEVER;
    rays[r].t_min = NEVER;
}

void start_packet() {
    EACH(start_ray)
}

void take_turn(int r) {
    bool comes = octant[r] == turn;
#ifdef INTERVAL_TEST
    comes = comes && begins_near(r);
#endif
    rays[r].t_min = comes ? t_turn[r] : through ? NEVER : rays[r].t_min;
    t_turn[r] = comes ? NEVER : t_turn[r];
}

void start_walk();

#ifndef STEPWISE

// A renderer runs packets side by side, and those that are at a leaf wait until the last one is. So whoever
// has found none after BOXES boxes stands by while the others test triangles, and walks on then. The first
// walk, all the way down, is about as long for all, and does not pause.
const int BOXES = 12;

void walk_on(int most);

// From the root, to the first leaf.
void begin_turn() {
#ifdef INTERVAL_TEST
    find_neighbourhood();
#endif
    EACH(take_turn)
#ifdef SHARED_AXES
    EACH(find_start)
#endif
#ifdef INTERVAL_TEST
    bound_rays();
#endif
#ifdef VERTEX_CULLING
    bound_frustum();
#endif
    start_walk();
    walk_on(step_limit);
}

#endif

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
#ifdef VERTEX_CULLING
        bool outside = culled(tested);
        while (outside && triangle_last(tested) == 0) {
            ++tested;
            outside = culled(tested);
        }
        if (!outside) {
            test_rays();
        }
#else
        test_rays();
#endif
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

#ifdef ENTRY_TILE
#include "drivers/packet_entry.glsl"
#else
#define first_node(root) root
#endif

#ifdef OCTANTS

// Along escape indices ---------------------------------------------------------------------------

#include "methods/bvh/bvh_nodes.glsl"

int node;
#ifdef SHARED_SUBTREES
int after;
#endif

void start_walk() {
#ifdef SHARED_SUBTREES
    after = -1;
#endif
    node = first_node((turn & 7) * node_count);
}

// A node, or what the beam meets next where it misses all up to there.
int jumped(int to) {
#ifdef ENTRY_TILE
    to = to == entry.link_1 ? entry.link_2 : to;
    to = to == entry.link_3 ? entry.link_4 : to;
#endif
    return to;
}

void test_box(int r) {
    vec2 interval = box_interval(rays[r], lo, hi);
    any_in = any_in || larger(interval.x, rays[r].t_min) <= smaller(interval.y, hits[r].t);
}

// One node: moves on to the next, and gives the first triangle of a leaf that a ray is in, else -1.
int visit() {
    COUNT(nodes_visited);
    ++steps;
    lo = bvh_node_lo(node);
    hi = bvh_node_hi(node);
#ifdef SHARED_SUBTREES
    order_corners(negative_axes(turn), lo, hi);
#endif
    int first = bvh_node_first(node);
#ifdef INTERVAL_TEST
    vec2 interval = bounding_interval(lo, hi);
    any_in = interval.x <= interval.y;
#else
    any_in = false;
    EACH(test_box)
#endif
    int escape = bvh_node_escape(node);
    bool down = any_in && first < 0;
#ifdef SHARED_SUBTREES
    int past = behind(escape, after);
    int next = below(node, first);
    after = way_out(first, escape, past, down, after);
#else
    int past = escape;
    int next = node + 1;
#endif
    past = jumped(past);   // a call within ?: would be a branch to llvmpipe
    node = down ? next : past;
    return any_in ? first : -1;
}

#ifndef STEPWISE

int leaf;   // where its triangles begin; -1: the walk pauses, the rays are through, or out of steps

// To the next leaf that a ray is in, or as far as `most` nodes lead.
void walk_on(int most) {
    // Carried from turn to turn of the loop: llvmpipe loses what only the last one computed, for
    // packets that leave it before others do.
    leaf = -1;
    int pause = min(step_limit, steps + most);
    do {
        leaf = visit();
    } while (leaf < 0 && node >= 0 && steps < pause);
    through = leaf < 0 && node < 0;
}

// Through the triangles of a leaf, and on towards the next one: in this order the first turn of the loop has
// triangles. False when the rays whose turn it is are through, or out of steps.
bool step_packet() {
    bool on = steps < step_limit;
    if (on && leaf >= 0) {
        on = intersect(leaf);
        through = !any_left || (on && node < 0);
        leaf = -1;
    }
    if (on && node >= 0 && steps < step_limit) {
        walk_on(BOXES);
    }
    return !through && steps < step_limit;
}

#endif

#else

// With a stack -----------------------------------------------------------------------------------

#include "methods/bvh/bvh_pairs.glsl"

int node;
int stacked;

#ifndef STEPWISE
int stack[STACK_SIZE];
#endif

#ifdef ENTRY_TILE
void put_on_stack(int link) {
    if (link != NO_LINK) {
        stack[stacked] = link;
        ++stacked;
    }
}
#endif

void start_walk() {
    stacked = 0;
    node = first_node(root);
#ifdef ENTRY_TILE
    put_on_stack(entry.link_1);
    put_on_stack(entry.link_2);
    put_on_stack(entry.link_3);
    put_on_stack(entry.link_4);
#endif
}

vec3 right_lo;
vec3 right_hi;
bool any_right;
int for_left;     // how many more rays meet the left child first

void test_boxes(int r) {
    vec2 left = box_interval(rays[r], lo, hi);
    vec2 right = box_interval(rays[r], right_lo, right_hi);
    left.x = larger(left.x, rays[r].t_min);
    right.x = larger(right.x, rays[r].t_min);
    bool in_left = left.x <= smaller(left.y, hits[r].t);
    bool in_right = right.x <= smaller(right.y, hits[r].t);
    any_in = any_in || in_left;
    any_right = any_right || in_right;
    bool left_first = in_left && (!in_right || left.x <= right.x);
    for_left += left_first ? 1 : (in_right ? -1 : 0);
}

// One inner node: moves on to the nearer child that a ray is in, or else to NOTHING, and gives the
// farther one if a ray is in that as well, else NOTHING.
int visit() {
    COUNT(nodes_visited);
    ++steps;
    lo = bvh_pair_left_lo(node);
    hi = bvh_pair_left_hi(node);
    right_lo = bvh_pair_right_lo(node);
    right_hi = bvh_pair_right_hi(node);
    int left = bvh_pair_left(node);
    int right = bvh_pair_right(node);
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
    bool both = any_in && any_right;
    bool left_first = any_in && (!any_right || for_left >= 0);
    node = left_first ? left : any_right ? right : NOTHING;
    return both ? (left_first ? right : left) : NOTHING;
}

#ifndef STEPWISE

bool on;   // the walk goes on

// Down to a leaf, from `node` or what the stack holds, or as far as `most` pairs of boxes lead.
void walk_on(int most) {
    on = true;
    int pause = min(step_limit, steps + most);
    if (!is_leaf(node)) {
        do {
            int far = visit();
            if (far != NOTHING) {
                stack[stacked] = far;
                ++stacked;
            } else if (node == NOTHING && stacked > 0) {
                --stacked;
                node = stack[stacked];
            } else if (node == NOTHING) {
                on = false;
            }
        } while (on && !is_leaf(node) && steps < pause);
    }
    through = !on;
}

// Through the triangles of a leaf, and on towards the next one; false when there is nothing left, or out of
// steps.
bool step_packet() {
    on = on && steps < step_limit;
    if (on && is_leaf(node)) {
        on = intersect(first_triangle(node));
        through = !any_left || (on && stacked == 0);
        if (on && !through) {
            --stacked;
            node = stack[stacked];
        }
    }
    if (on && !through && steps < step_limit) {
        walk_on(BOXES / 2);   // a pair has two
    }
    return on && !through && steps < step_limit;
}

#endif
#endif
