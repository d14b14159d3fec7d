#version 330 core
// Add a light's contribution to the sum of each pixel by blending: the light that needs no shadow ray
// (`lit`), plus the direct light if the shadow ray hit nothing. With BOUNCES, multiply the contribution by
// the weight of the pixel's path.

#include <streams>
#include "core/hit.glsl"

#ifdef BOUNCES
uniform bool first_wave;    // whether the rays are eye rays, of weight 1
#endif

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 light = lit_load(pixel).ambient;
#ifdef SHADOWS
    light += hit_found(hit_load(pixel)) ? vec3(0.0) : direct_load(pixel).light;
#endif
#ifdef BOUNCES
    light *= first_wave ? vec3(1.0) : path_load(pixel).weight;
#endif
    radiance_store(Radiance(light));
}
