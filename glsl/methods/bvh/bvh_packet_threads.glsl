// bvh-packet with `octants`: a packet walks along escape indices, without a stack (Thrane and Simonsen
// 2005; survey, section 3.5, Figure 19). The rays of a turn share an octant (drivers/packet_turns.glsl).
// They walk the tree's copy that is threaded front to back for their octant. A packet enters a node if any
// ray meets the node's box. Otherwise the packet follows the node's escape index.
//
// Options choose the files behind <box_tests> (packet_common.glsl), <entry> and <subtrees>. With
// `entry_points`, the packet begins at the first subtree that a beam has found, and jumps over nodes that
// the beam misses (methods/bvh/entry_threads.glsl). With `shared_subtrees`, the copies share the lower part
// of the tree (methods/bvh/shared_subtrees.glsl).

#include "methods/bvh/packet_common.glsl"
#include "methods/bvh/bvh_nodes.glsl"
#include <entry>

int node;
int after;   // the node after the shared subtree that the walk is in; -1 outside shared subtrees

void start_walk() {
    after = -1;
    node = first_node((turn & 7) * node_count);
}

// Visit a node -----------------------------------------------------------------------------------

vec3 lo;
vec3 hi;
bool any_in;   // whether any ray meets the box

void test_box(int r) {
    vec2 interval = searched(r, lo, hi);
    any_in = any_in || interval.x <= interval.y;
}

// Visit a node and move on. Return a leaf's first triangle if a ray meets the leaf, else a negative number.
int visit() {
    COUNT(nodes_visited);
    ++steps;
    lo = bvh_node_lo(node);
    hi = bvh_node_hi(node);
    order_corners(negative_axes(turn), lo, hi);
    int first = bvh_node_first(node);
    any_in = false;
    TESTERS(test_box)
    int escape = bvh_node_escape(node);
    bool down = any_in && first < 0;
    int past = behind(escape, after);
    int next = below(node, first);
    after = way_out(first, escape, past, down, after);
    past = jumped(past);   // a separate statement: llvmpipe compiles a call within ?: to a branch
    node = down ? next : past;
    return any_in ? first : -1;
}

// Walk -------------------------------------------------------------------------------------------

int leaf;   // the first triangle of the leaf that the walk reached; below 0 if it reached none

// Walk to the next leaf whose box a ray meets. Stop after `most` nodes.
void walk_on(int most) {
    leaf = -1;
    int pause = min(step_limit, steps + most);
    do {
        leaf = visit();
    } while (leaf < 0 && node >= 0 && steps < pause);
    through = leaf < 0 && node < 0;
}

// Test the triangles of a leaf, then walk on towards the next leaf. `begin_turn` has already walked to the
// first leaf. Return false when the rays of the turn have finished, or at the step limit.
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
