#version 330 core
// From packets to rays: each ray's state, hit and counters, as single-ray methods leave them. With
// ROWS_ALONE the hit comes from testing the triangle once more, which gives the same bits.

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

#ifdef ROWS_ALONE
#define DECLARE(k) uniform usampler2D packet_texels_##k;
#else
#define DECLARE(k) uniform sampler2D packet_texels_##k;
#endif
EACH_TARGET(DECLARE)
#ifdef STATISTICS
uniform sampler2D packet_counters;
#endif
uniform int unsettled_phase;   // of a ray that its packet's limit on steps left behind

#define READ(k) texel = target == k ? TEXEL(packet_texels_##k, packet_step, packet) : texel;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    ivec2 packet = pixel / PACKET_SIZE;
    ivec2 place = pixel - packet * PACKET_SIZE;
    int r = place.x + PACKET_WIDTH * place.y;
    bool settled;
    vec2 packet_step = 1.0 / vec2(textureSize(packet_texels_0, 0));
#ifdef ROWS_ALONE
    int target = r / 4;
    uvec4 texel = uvec4(0u);
    EACH_TARGET(READ)
    int row = unpacked_row(texel[r % 4], settled);
    Ray ray = ray_setup(rays_load(pixel));
    Hit hit = no_hit(ray.t_max);
#ifdef STATISTICS
    counters = Counters(0, 0, 0);
#endif
    if (row != NO_TRIANGLE) {
        test_triangle(ray, row, hit);
    }
#else
#ifdef TRIANGLES_ALONE
#define READ_TRIANGLE(k) texel.w = k == r / 4 ? TEXEL(packet_texels_##k, packet_step, packet)[r % 4] : texel.w;
    vec4 texel = vec4(0.0);
    EACH_TARGET(READ_TRIANGLE)
#elif defined(FOURS)
#define READ_NUMBER(k) texel[k % 4] = k / 4 == r / 4 ? TEXEL(packet_texels_##k, packet_step, packet)[r % 4] : texel[k % 4];
    vec4 texel = vec4(0.0);
    EACH_TARGET(READ_NUMBER)
#else
    int target = r;
    vec4 texel = vec4(0.0);
    EACH_TARGET(READ)
#endif
    Hit hit = unpacked_hit(texel, settled);
#endif
    State state = State(settled ? DONE : unsettled_phase, 0);
#ifdef STATISTICS
    vec4 counted = texelFetch(packet_counters, packet, 0);
    state.steps = int(counted.w);
    counters_store(Counters(int(counted.x), int(counted.y), int(counted.z)));
#endif
    state_store(state);
    hit_store(hit_stored(hit));
}
