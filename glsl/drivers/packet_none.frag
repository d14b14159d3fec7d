#version 330 core
// What packets hold whose rays meet nothing, or of which none is live: drawn over the tiles that
// drivers/packet.frag leaves out, into the targets that hold triangles: nobody reads more of a miss. To
// clear all of a target first is to write most of it twice. Packets that are not drawn count nothing.

#include <streams>

#ifdef STATISTICS
out vec4 packet_counters;
#else
layout(location = 0) out vec4 packet_target[PACKET_TARGETS];
#endif

#define STORE(k) packet_target[k] = vec4(NO_TRIANGLE);

void main() {
#ifdef STATISTICS
    packet_counters = vec4(0.0);
#else
    EACH_TARGET(STORE)
#endif
}
