#version 330 core
// The picture: ambient light everywhere, direct light where no shadow ray hit; sRGB.

#include <streams>
#include "common/hit.glsl"

out vec4 colour;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Lit lit = lit_load(pixel);
    vec3 light = lit.ambient + (hit_found(hit_load(pixel)) ? vec3(0.0) : lit.direct);
    light = clamp(light, 0.0, 1.0);
    colour = vec4(mix(12.92 * light, 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055,
                      step(0.0031308, light)), 1.0);
}
