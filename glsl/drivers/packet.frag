#version 330 core
// The driver of packet methods. One fragment traces the RAYS rays of a packet in one pass and writes their
// hits to several render targets (Horn et al. 2007). The file <targets> defines the layout of the hits.
//
// A ray is unsettled if the step limit stopped its packet before the ray's search was over. With
// SETTLED_ALONE a packet with an unsettled ray is discarded. If an occlusion query then shows that a
// packet is missing, which is rare, all packets are drawn again without SETTLED_ALONE. The query replaces a
// pass that would search the hits for unsettled rays.
//
// The file <method> defines four functions:
//   `start_packet` sets up all rays.
//   `begin_turn` begins the turn that `rays_wait` chose; drivers/packet_turns.glsl defines turns.
//   `step_packet` continues the walk. It returns false when the rays of the turn have finished.
//   `is_settled(r)` is false if the step limit stopped ray r.
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
out vec4 packet_counters;   // written in a separate pass, because hits may fill all render targets
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
