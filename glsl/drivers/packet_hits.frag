#version 330 core
// Distributes the results of packets to their rays: writes the state, the hit and the counters of each ray
// as a single-ray method would. The file <targets> defines the layout of the hits in the packets' render
// targets.

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
#include <targets>

#define DECLARE(k) uniform TARGET_SAMPLER packet_texels_##k;
EACH_TARGET(DECLARE)
#ifdef STATISTICS
uniform sampler2D packet_counters;
#endif
uniform int unsettled_phase;   // the phase of rays that the step limit stopped (packet.frag)

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    ivec2 packet = pixel / PACKET_SIZE;
    ivec2 place = pixel - packet * PACKET_SIZE;
    int r = place.x + PACKET_WIDTH * place.y;
    vec2 packet_step = 1.0 / vec2(textureSize(packet_texels_0, 0));
    TARGET texel = TARGET(0);
    EACH_TARGET(READ)
    bool settled;
    Hit hit = HIT_OF(texel);
    State state = State(settled ? DONE : unsettled_phase, 0);
#ifdef STATISTICS
    vec4 counted = texelFetch(packet_counters, packet, 0);
    state.steps = int(counted.w);
    counters_store(Counters(int(counted.x), int(counted.y), int(counted.z)));
#endif
    state_store(state);
    hit_store(hit_stored(hit));
}
