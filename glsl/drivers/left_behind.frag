#version 330 core
// Selects the rays whose packet reached the step limit before their search was over (packet.frag). A
// single-ray method then traces only these rays, because all other rays get an empty interval.

#include "core/precision.glsl"
#include "core/phase.glsl"
#include <streams>

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Rays ray = rays_load(pixel);
    bool left_behind = state_load(pixel).phase > DONE;
    Single_rays single;
    single.origin = ray.origin;
    single.direction = ray.direction;
    single.t_min = left_behind ? ray.t_min : 1.0;
    single.t_max = left_behind ? ray.t_max : -1.0;
#ifdef AFTER_HIT
    single.after = ray.after;
#endif
    single_rays_store(single);
}
