// Fills a packet's stack at the start of a walk from the links of the packet's entry, with link_1 at the
// bottom.

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
