// In a packet's walk along escape indices, jumps over nodes that the beam around the tile's rays misses.
// The beam stops at the roots of subtrees (methods/bvh/beam_step.glsl). From link_1, the node after the
// first of these subtrees, the walk jumps to link_2, the root of the second. From link_3, the node after
// the second subtree, the walk jumps to link_4, the root of the third.

#include "drivers/packet_entry.glsl"

int jumped(int to) {
    to = to == entry.link_1 ? entry.link_2 : to;
    to = to == entry.link_3 ? entry.link_4 : to;
    return to;
}
