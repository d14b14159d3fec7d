#version 330 core
// The result of packets without a hit or without a live ray. It is drawn over the tiles that
// drivers/packet.frag omits, and only into the targets that hold triangles, because no reader needs more of
// a miss. To clear whole targets first would write most texels twice. Packets that are not drawn count
// nothing.

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
