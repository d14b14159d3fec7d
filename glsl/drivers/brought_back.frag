#version 330 core
// Writes the results of the unsettled rays (packet.frag), which a single-ray method has traced
// (left_behind.frag). All other rays stay unchanged.

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
