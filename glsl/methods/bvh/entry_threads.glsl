// The links of a packet's entry in a walk along escape indices. They describe two jumps over nodes that the
// beam misses. The walk jumps from link_1, where the beam leaves the subtree that it entered, to link_2,
// and from link_3 to link_4.

#include "drivers/packet_entry.glsl"

int jumped(int to) {
    to = to == entry.link_1 ? entry.link_2 : to;
    to = to == entry.link_3 ? entry.link_4 : to;
    return to;
}
