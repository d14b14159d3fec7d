#version 330 core
// Runs each ray's part of a packet's step, under the schedule `step`. One fragment serves one ray. If the
// ray's packet is at a triangle, the ray tests the triangle. The first fields of the ray's new state are a
// copy of the packet's phase and step count.
//
// The file <ray_step> defines `step_ray`, which does the step of the ray in rays[0] and hits[0] and returns
// the ray's new state.

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
#include "core/phase.glsl"
#include "drivers/packet.glsl"
#include "drivers/packet_rays.glsl"

Packet_state packet;

#include <ray_step>

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    packet = packet_state_load(pixel / PACKET_OF_RAY);
    CLEAR_COUNTERS;
    load(0);
#ifndef START
    hits[0] = hit_load(pixel);
#endif
    state_store(step_ray());
    hit_store(hit_stored(hits[0]));
#ifdef STATISTICS
    Packet_counters counted = packet_counters_load(pixel / PACKET_OF_RAY);
    counters_store(Counters(counted.nodes_visited, counted.leaves_visited,
                            counted.triangles_tested));
#endif
}
