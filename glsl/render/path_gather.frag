#version 330 core
// What a vertex adds to its path, blended onto what it has found before: what it met, and the light
// that it asked where no shadow ray hit. A path that adds nothing and goes no further is left out, so
// that an occlusion query around this pass tells when no vertex more is needed.

#include <streams>
#include "core/hit.glsl"

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    vec3 light = lit_load(texel).ambient;
#ifdef SHADOWS
    light += hit_found(hit_load(texel)) ? vec3(0.0) : direct_load(texel).light;
#endif
    if (light == vec3(0.0) && walk_load(texel).weight == vec3(0.0)) {
        discard;
    }
    radiance_store(Radiance(light));
}
