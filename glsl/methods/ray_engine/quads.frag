#version 330 core
// A pair of ray and triangle: Carr, Hall, Hart 2002 (see methods/ray_engine/ray_engine.glsl). What a fragment
// leaves, blending or the depth test reduces to one a ray:
//   KEEP_NEAREST  t, of which MIN blending keeps the least;
//   KEEP_FIRST    the triangle, where t is that least: MIN blending keeps the lowest;
//   KEEP_DEPTH    t as depth, and the triangle of the first among the nearest.

#include "core/precision.glsl"
#include <streams>
#include "core/stats.glsl"
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/hit.glsl"
#include <method>
#include "core/triangle.glsl"

uniform float depth_end;   // t that the depth of 1 stands for
const float DEPTH_STEPS = 16777215.0;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Ray ray = ray_setup(rays_load(pixel));
    Hit hit = no_hit(ray.t_max);
    test_triangle(ray, quad_triangle, hit);
    if (!hit_found(hit)) {
        discard;
    }
    float t = stored(hit.t);
#ifdef KEEP_NEAREST
    nearest_store(Nearest(t));
#else
#ifdef KEEP_FIRST
    if (t != nearest_load(pixel).t) {
        discard;
    }
#else
    // To the steps of 24 bits here, too: a renderer's depth buffer may have finer ones.
    gl_FragDepth = round(clamp(t / depth_end, 0.0, 1.0) * DEPTH_STEPS) / DEPTH_STEPS;
#endif
    found_store(Found(hit.triangle));
#endif
}
