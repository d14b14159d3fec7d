// In a packet's walk along escape indices, jumps over nodes that the beam around the tile's rays misses.
// The beam has found the first three subtrees to search (methods/bvh/packet_entry_threads.glsl). A walk
// that leaves the first subtree, at the node link_1, jumps to the root of the second, link_2. A walk that
// leaves the second subtree, at link_3, jumps to the root of the third, link_4.

#include "drivers/packet_entry.glsl"

int jumped(int to) {
    to = to == entry.link_1 ? entry.link_2 : to;
    to = to == entry.link_3 ? entry.link_4 : to;
    return to;
}
