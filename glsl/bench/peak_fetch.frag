#version 330 core
// Measures the peak of texel fetches of the roofline (gpgpu_rt/bench/roofline.py): TURNS fetches and almost
// no other work. Neighbouring fragments fetch neighbouring texels; with SCATTERED each fragment fetches
// pseudo-random texels.

#include "core/texel.glsl"

uniform sampler2D texels_table;

out vec4 sum;

const uint SIDE = 1u << uint(SIDE_LOG2);

void main() {
    uvec2 pixel = uvec2(gl_FragCoord.xy);
    sum = vec4(0.0);
#ifdef SCATTERED
    uint at = (pixel.x * 1973u + pixel.y * 9277u) * 26699u;
#endif
    for (int turn = 0; turn < TURNS; ++turn) {
#ifdef SCATTERED
        at = at * 1664525u + 1013904223u;
        uvec2 texel = uvec2(at >> 5, at >> 17);
#else
        uvec2 texel = pixel + uint(turn);
#endif
        sum += TEXEL(texels_table, 1.0 / float(SIDE), ivec2(texel & (SIDE - 1u)));
    }
}
