#version 330 core
// Add the samples of a wave (the paths traced at once) to the sums of each pixel. Samples are added in
// order, so the sums do not depend on the number of samples in a wave. The rounding error of each addition
// corrects the next addition (Kahan, "Further Remarks on Reducing Truncation Errors", CACM 1965).

#include "core/precision.glsl"
#include <streams>
#include "render/walk.glsl"
#include "render/luminance.glsl"

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Sums sums = sums_load(pixel);
    PRECISE vec4 sum = sums.total;
    PRECISE vec4 lost = sums.lost;
    for (int y = 0; y < block.y; ++y) {
        for (int x = 0; x < block.x; ++x) {
            ivec2 texel = pixel * block + ivec2(x, y);
            vec3 light = radiance_load(texel).sum;
            float bright = luminance(light);
            PRECISE vec4 value = vec4(light, bright * bright) - lost;
            PRECISE vec4 next = sum + value;
            PRECISE vec4 kept = next - sum;
            if (walk_sample(texel) < samples) {
                lost = kept - value;
                sum = next;
            }
        }
    }
    next_sums_store(Next_sums(sum, lost));
}
