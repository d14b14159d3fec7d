#version 330 core
// Writes the hits of a batch's rays. Blending or the depth test kept a triangle for each ray
// (methods/ray_engine/ray_engine.glsl). To get t, u and v, the ray tests this triangle again.

#include "core/precision.glsl"
#include "core/fetch.glsl"
#include <streams>
#include <tables>
#include "core/stats.glsl"
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/hit.glsl"
#include <pair_test>

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Ray ray = ray_setup(rays_load(pixel));
    Hit hit = no_hit(ray.t_max);
    int triangle = found_load(pixel).triangle;
    if (triangle != NO_TRIANGLE) {
        test_pair(ray, triangle, hit);
    }
    hit_store(hit);
}
