// The links of a packet's entry, in a walk along escape indices. The links are two jumps over nodes that
// the beam misses. link_1 is the first node after the first subtree that the beam entered. From link_1 the
// walk jumps to link_2, the root of the next such subtree, and from link_3 it jumps to link_4.

#include "drivers/packet_entry.glsl"

int jumped(int to) {
    to = to == entry.link_1 ? entry.link_2 : to;
    to = to == entry.link_3 ? entry.link_4 : to;
    return to;
}
