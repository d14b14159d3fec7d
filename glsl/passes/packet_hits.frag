#version 330 core
// From packets to rays: each ray's state, hit and counters, as single-ray methods leave them. u and
// v come from testing the triangle once more, which gives the same bits.

#include "common/precision.glsl"
#include "common/fetch.glsl"
#include <streams>
#include <tables>
#include "common/stats.glsl"
#include "common/slack.glsl"
#include "common/ray.glsl"
#include "common/hit.glsl"
#include "common/triangle.glsl"
#include "common/phase.glsl"
#include "common/packet.glsl"

#define DECLARE(k) uniform usampler2D packet_texels_##k;
EACH_PAIR(DECLARE)
#ifdef STATISTICS
uniform sampler2D packet_counters;
#endif
uniform int unsettled_phase;   // of a ray that its packet's limit on steps left behind

#define READ(k) texel = pair == k ? texelFetch(packet_texels_##k, packet, 0) : texel;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    ivec2 packet = pixel / PACKET_SIZE;
    ivec2 place = pixel - packet * PACKET_SIZE;
    int r = place.x + PACKET_WIDTH * place.y;
    int pair = r / 2;
    uvec4 texel = uvec4(0u);
    EACH_PAIR(READ)
    uint triangle = r % 2 == 0 ? texel.y : texel.w;

    Ray ray = ray_setup(rays_load(pixel));
    Hit hit = no_hit(ray.t_max);
    State state = State((triangle & UNSETTLED) != 0u ? unsettled_phase : DONE, 0);
#ifdef STATISTICS
    vec4 counted = texelFetch(packet_counters, packet, 0);
    state.steps = int(counted.w);
    counters = Counters(0, 0, 0);
#endif
    int index = int(triangle & ~UNSETTLED);
    if (index != NO_TRIANGLE) {
        test_triangle(ray, index, hit);
    }
    state_store(state);
    hit_store(hit_stored(hit));
#ifdef STATISTICS
    counters_store(Counters(int(counted.x), int(counted.y), int(counted.z)));
#endif
}
