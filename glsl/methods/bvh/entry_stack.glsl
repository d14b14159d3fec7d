// At the start of a packet's walk, pushes the links of the packet's entry onto the empty stack, link_1
// first.

#include "drivers/packet_entry.glsl"

void push_link(int link) {
    if (link != NO_LINK) {
        stack[stacked] = link;
        ++stacked;
    }
}

void push_links() {
    push_link(entry.link_1);
    push_link(entry.link_2);
    push_link(entry.link_3);
    push_link(entry.link_4);
}
