// The links of a packet's entry, in a walk along escape indices. The links are two jumps over nodes that
// the beam misses. The beam stops at the roots of subtrees (methods/bvh/beam_step.glsl). link_1 is the node
// after the first of these subtrees. From link_1 the walk jumps to link_2, the root of the second subtree.
// link_3 is the node after the second subtree. From link_3 the walk jumps to link_4, the root of the third.

#include "drivers/packet_entry.glsl"

int jumped(int to) {
    to = to == entry.link_1 ? entry.link_2 : to;
    to = to == entry.link_3 ? entry.link_4 : to;
    return to;
}
