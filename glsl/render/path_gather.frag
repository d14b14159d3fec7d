#version 330 core
// Add the light at a path's vertex to the light of the path, by blending: the light that the path's own ray
// found (`lit`), plus the sampled light if the shadow ray hit nothing. A fragment is discarded if its path
// has ended and adds nothing. So an occlusion query around this pass shows when no vertex remains.

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
