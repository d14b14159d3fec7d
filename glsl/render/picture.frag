#version 330 core
// Write the picture in sRGB. With GATHERED the light of a pixel is the sum that other passes gathered,
// divided by the number of samples. Without GATHERED there is one sample per pixel, at most one shadow ray
// per hit, and no bounce. A pixel then gets the light that needs no shadow ray: ambient light and emission,
// or the surroundings if the eye ray hit nothing. The direct light is added if the shadow ray hit nothing.
// The host sets `linear` if it applies an exposure or a tone map. The picture is then linear, not clipped.

#include <streams>
#include "core/hit.glsl"

out vec4 colour;

#ifdef GATHERED
uniform float sample_share;     // 1 divided by the number of samples in the sum
#endif

uniform bool linear;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
#ifdef GATHERED
    vec3 light = radiance_load(pixel).sum * sample_share;
#else
    vec3 light = lit_load(pixel).ambient;
#ifdef SHADOWS
    light += hit_found(hit_load(pixel)) ? vec3(0.0) : direct_load(pixel).light;
#endif
#endif
    if (linear) {
        colour = vec4(light, 1.0);
        return;
    }
    light = clamp(light, 0.0, 1.0);
    colour = vec4(mix(12.92 * light, 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055,
                      step(0.0031308, light)), 1.0);
}
