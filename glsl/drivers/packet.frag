#version 330 core
// The driver of packet methods: traces RAYS rays a fragment, their whole way in one pass, and
// writes their hits to as many render targets, as Horn et al. 2007 do; where there are four or more,
// a target takes one number of four hits, and not four numbers of one (FOURS), and of any hit that is
// asked for only their triangles are written (TRIANGLES_ALONE). With ROWS_ALONE
// there are more rays than targets: each takes the rows of the triangles that four rays hit, and
// drivers/packet_hits.frag computes the hits again. With SETTLED_ALONE a packet that leaves a ray behind
// is discarded: an occlusion query then tells whether there is any, and all are drawn again without.
// So no pass has to look at what packets wrote, for the sake of a limit that is hardly ever met.
//
// A method defines start_packet; begin_turn, for the rays whose turn it is (drivers/packet_turns.glsl);
// step_packet, false when they are through; and is_settled(r), which tells a ray that is from one that
// the limit on steps left behind. Loops end at their bottom, as in drivers/traverse.frag.

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

#ifdef STATISTICS
out vec4 packet_counters;   // drawn apart: hits may fill all render targets
#else
#ifdef ROWS_ALONE
layout(location = 0) out uvec4 packet_target[PACKET_TARGETS];
#else
layout(location = 0) out vec4 packet_target[PACKET_TARGETS];
#endif
#endif

#ifdef ROWS_ALONE
#define ROW(r) packed_row(rows[r], is_settled(r))
#define STORE(k) packet_target[k] = uvec4(ROW(4 * k), ROW(4 * k + 1), ROW(4 * k + 2), ROW(4 * k + 3));
#else
vec4 numbers[RAYS];

void pack(int r) {
    numbers[r] = packed_hit(hits[r], is_settled(r));
}

#ifdef TRIANGLES_ALONE
#define PACKED(k, r) numbers[4 * k + r].w
#elif defined(FOURS)
#define PACKED(k, r) numbers[k / 4 * 4 + r][k % 4]
#endif

#ifdef FOURS
#define STORE(k) packet_target[k] = vec4(PACKED(k, 0), PACKED(k, 1), PACKED(k, 2), PACKED(k, 3));
#else
#define STORE(k) packet_target[k] = numbers[k];
#endif
#endif

#ifdef SETTLED_ALONE
bool all_settled = true;

void see_settled(int r) {
    all_settled = all_settled && is_settled(r);
}
#endif

void main() {
#ifdef STATISTICS
    counters = Counters(0, 0, 0);
#endif
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
#ifdef STATISTICS
    packet_counters = vec4(counters.nodes_visited, counters.leaves_visited,
                           counters.triangles_tested, steps);
#else
#ifdef SETTLED_ALONE
    EACH(see_settled)
    if (!all_settled) {
        discard;
    }
#endif
#ifndef ROWS_ALONE
    EACH(pack)
#endif
    EACH_TARGET(STORE)
#endif
}
