#version 330 core
// What a light adds to pixels, blended onto the sum of those before: what arrives anyway, and the
// light itself where no shadow ray hit, each by its path's weight.

#include <streams>
#include "core/hit.glsl"

#ifdef BOUNCES
uniform bool first_wave;
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
