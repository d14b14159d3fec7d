#version 330 core
// Writes "no hit" for the packets of the tiles that drivers/packet.frag omits: these packets have no live
// ray, or hit nothing. Only the render targets that hold triangles are written, because a reader that finds
// no triangle reads nothing else. Clearing whole targets before the trace would write most texels twice.
// The counters of these packets are 0.

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
