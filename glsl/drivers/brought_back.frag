#version 330 core
// Copies states and hits back to the textures of all rays, for the rays that left_behind.frag selected and
// a single-ray method has traced. Other rays stay unchanged.

#include "core/precision.glsl"
#include "core/phase.glsl"
#include <streams>

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Single_rays ray = single_rays_load(pixel);
    if (!(ray.t_min <= ray.t_max)) {
        discard;
    }
    Single_state single = single_state_load(pixel);
    state_store(State(single.phase, single.steps));
    Single_hit hit = single_hit_load(pixel);
    hit_store(Hit(hit.t, hit.u, hit.v, hit.triangle));
}
