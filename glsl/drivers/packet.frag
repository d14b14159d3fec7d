#version 330 core
// The driver of packet methods. One fragment traces the RAYS rays of a packet in one pass and writes their
// hits to several render targets (Horn et al. 2007). The file <targets> defines the layout of the hits. A
// separate pass writes the counters.
//
// With SETTLED_ALONE a packet that leaves a ray unsettled is discarded. An occlusion query then tells
// whether there is such a packet. If so, all packets are drawn again without SETTLED_ALONE. So no pass has
// to read the hits for the sake of a step limit that packets hardly ever reach.
//
// The file <method> defines four functions:
//   `start_packet` sets up all rays.
//   `begin_turn` begins the walk of the rays of a turn (drivers/packet_turns.glsl).
//   `step_packet` continues the walk. It returns false when the rays of the turn have finished.
//   `is_settled(r)` is false for a ray that the step limit stopped.
// Loops test their condition at the bottom, for the reason given in drivers/traverse.frag.

#include "core/precision.glsl"
#include "core/fetch.glsl"
#include <streams>
#include <tables>
#include "core/stats.glsl"
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/hit.glsl"
#include "core/box.glsl"
#include "core/triangle.glsl"
#include "drivers/packet.glsl"
#include "drivers/packet_rays.glsl"
#include <method>
#include <targets>

#ifdef STATISTICS
out vec4 packet_counters;   // in a pass of its own: hits may fill all render targets
#else
layout(location = 0) out TARGET packet_target[PACKET_TARGETS];
#endif

vec4 numbers[RAYS];
bool all_settled = true;

void pack(int r) {
    numbers[r] = packed_hit(hits[r], is_settled(r));
}

void see_settled(int r) {
    all_settled = all_settled && is_settled(r);
}

void main() {
    CLEAR_COUNTERS;
    EACH(load)
    start_packet();
    bool more = rays_wait();
    do {
        bool on = more;
        if (more) {
            begin_turn();
        }
        do {
            if (on) {
                on = step_packet();
            }
        } while (on && steps < step_limit);
        more = rays_wait();
    } while (more && steps < step_limit);
#ifdef SETTLED_ALONE
    EACH(see_settled)
    if (!all_settled) {
        discard;
    }
#endif
#ifdef STATISTICS
    packet_counters = vec4(counters.nodes_visited, counters.leaves_visited,
                           counters.triangles_tested, steps);
#else
    EACH(pack)
    EACH_TARGET(STORE)
#endif
}
