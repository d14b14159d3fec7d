#version 330 core
// The part of a packet's step that runs for each ray, under the schedule `step`. If the packet is at a
// triangle, each of its rays tests the triangle. A ray's state is a copy of the phase and the step count of
// its packet.

#include "core/precision.glsl"
#include "core/fetch.glsl"
#include <streams>
#include <tables>
#include "core/stats.glsl"
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/hit.glsl"
#include "core/triangle.glsl"
#include "core/phase.glsl"
#include "drivers/packet.glsl"
#include "drivers/packet_turns.glsl"

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Packet_state packet = packet_state_load(pixel / PACKET_SIZE);
    Ray ray = ray_setup(rays_load(pixel));
#ifdef START
    Hit hit = no_hit(ray.t_max);
#else
    Hit hit = hit_load(pixel);
#endif
    CLEAR_COUNTERS;
    bool present = ray.t_min <= ray.t_max && octant_of(ray) == packet.turn;
    if (packet.phase == INTERSECT && present && !search_over(hit)) {
        test_triangle(ray, packet.cursor, hit);
    }
    state_store(State(packet.phase, packet.steps));
    hit_store(hit_stored(hit));
#ifdef STATISTICS
    Packet_counters counted = packet_counters_load(pixel / PACKET_SIZE);
    counters_store(Counters(counted.nodes_visited, counted.leaves_visited,
                            counted.triangles_tested));
#endif
}
