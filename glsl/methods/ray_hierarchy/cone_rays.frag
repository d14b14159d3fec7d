#version 330 core
// Writes the lowest level of a ray hierarchy: one node for each ray, and an empty node for a ray that has
// ended.

#include "core/precision.glsl"
#include <streams>
#include "core/phase.glsl"
#include "methods/ray_hierarchy/ray_hierarchy.glsl"

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Rays ray = rays_load(pixel);
    bool live = state_load(pixel).phase > DONE;
    float end = hit_load(pixel).t;
    cone_store(live ? cone_of_ray(ray.origin, ray.direction, ray.t_min, end) : no_cone());
}
