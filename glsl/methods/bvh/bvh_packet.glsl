// bvh-packet: Günther, Popov, Seidel, Slusallek, "Realtime Ray Tracing on GPU with BVH-based Packet
// Traversal", RT 2007 (survey, section 3.5, Figure 22). The rays of a packet share one node pointer and one
// stack. Each ray tests the boxes of both children. The packet enters a child if any ray meets the child's
// box. If rays meet both boxes, the packet enters the child that more rays meet first, and pushes the
// other child.
//
// Departures: in the paper a warp traces the packet, and the votes of the rays are summed in shared memory.
// Here one fragment traces the packet and sums the votes. Some options need rays that agree in the signs or
// the dominant axis of their directions. Then the packet walks once for each such group of rays
// (drivers/packet_turns.glsl). A long walk pauses (core/lockstep.glsl). With `interval_test`, a single test
// of a box by interval arithmetic serves all rays (drivers/boxes_by_interval.glsl, the file <box_tests>).
// With `entry_points`, the packet begins at a node that a beam around its rays found
// (methods/bvh/entry_stack.glsl, the file <entry>).

#include "methods/bvh/packet_common.glsl"
#include "methods/bvh/bvh_pairs.glsl"

int node;
int stacked;
int stack[STACK_SIZE];

#include <entry>

void start_walk() {
    stacked = 0;
    node = first_node(root);
    push_links();
}

// Visit an inner node ----------------------------------------------------------------------------

vec3 left_lo;
vec3 left_hi;
vec3 right_lo;
vec3 right_hi;
bool any_left_in;     // whether any ray meets the left box
bool any_right_in;
int for_left;         // rays that meet the left child first, minus the rays that meet the right child first

void test_boxes(int r) {
    vec2 left = searched(r, left_lo, left_hi);
    vec2 right = searched(r, right_lo, right_hi);
    bool in_left = left.x <= left.y;
    bool in_right = right.x <= right.y;
    any_left_in = any_left_in || in_left;
    any_right_in = any_right_in || in_right;
    bool left_first = in_left && (!in_right || left.x <= right.x);
    for_left += left_first ? 1 : (in_right ? -1 : 0);
}

// Visit an inner node: move on to the child that the packet enters first, or to NOTHING if all rays miss
// both boxes. Return the other child if a ray meets that child's box, else NOTHING.
int visit() {
    COUNT(nodes_visited);
    ++steps;
    left_lo = bvh_pair_left_lo(node);
    left_hi = bvh_pair_left_hi(node);
    right_lo = bvh_pair_right_lo(node);
    right_hi = bvh_pair_right_hi(node);
    int left = bvh_pair_left(node);
    int right = bvh_pair_right(node);
    any_left_in = any_right_in = false;
    for_left = 0;
    TESTERS(test_boxes)
    bool both = any_left_in && any_right_in;
    bool left_first = any_left_in && (!any_right_in || for_left >= 0);
    node = left_first ? left : any_right_in ? right : NOTHING;
    return both ? (left_first ? right : left) : NOTHING;
}

// Walk -------------------------------------------------------------------------------------------

bool on;   // whether the walk continues

// Walk from `node` to the next leaf, but test at most `most` pairs of boxes. If the packet enters no child
// of a node, pop a node from the stack.
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

// Test the triangles of a leaf, pop the next node, and walk on towards the next leaf. Return false when the
// rays of the turn have finished, or at the step limit.
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
        walk_on(BOXES / 2);   // a pair has two boxes
    }
    return on && !through && steps < step_limit;
}
