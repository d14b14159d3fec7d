#version 330 core
// What a batch's rays hit: t, u and v of the one triangle that is left of each ray's quads (see
// methods/ray_engine/ray_engine.glsl), computed again from its row.

#include "core/precision.glsl"
#include "core/fetch.glsl"
#include <streams>
#include <tables>
#include "core/stats.glsl"
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/hit.glsl"
#include "core/triangle.glsl"

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Ray ray = ray_setup(rays_load(pixel));
    Hit hit = no_hit(ray.t_max);
    int triangle = found_load(pixel).triangle;
    if (triangle != NO_TRIANGLE) {
        test_triangle(ray, triangle, hit);
    }
    hit_store(hit);
}
