#version 330 core
// Add a vertex's light to its path by blending: light met by the path (`lit`), and sampled light where no
// shadow ray hit. A path that adds nothing and has ended discards, so that an occlusion query around this
// pass tells when no further vertex is needed.

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
