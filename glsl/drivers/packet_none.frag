#version 330 core
// Writes "no hit" for packets that packet.frag does not trace: their tile has no live ray, or its beam
// meets nothing. Only render targets that hold triangles are written: a reader that finds no triangle uses
// no other number of the hit. Clearing whole targets before the trace would write most texels twice.

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
