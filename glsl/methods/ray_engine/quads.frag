#version 330 core
// A pair of ray and triangle: Carr, Hall, Hart 2002 (see methods/ray_engine/ray_engine.glsl). Blending or the
// depth test reduces the fragments of a ray to one result:
//   KEEP_NEAREST  writes t; MIN blending keeps the least
//   KEEP_FIRST    writes the triangle where t is that least; MIN blending keeps the lowest triangle
//   KEEP_DEPTH    writes t as depth, and the triangle: the first triangle among the nearest stays

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
#if defined(KEEP_NEAREST)
    nearest_store(Nearest(t));
#elif defined(KEEP_FIRST)
    if (t != nearest_load(pixel).t) {
        discard;
    }
    found_store(Found(hit.triangle));
#else
    // Round to steps of 24 bits: a renderer's depth buffer may have finer ones.
    gl_FragDepth = round(clamp(t / depth_end, 0.0, 1.0) * DEPTH_STEPS) / DEPTH_STEPS;
    found_store(Found(hit.triangle));
#endif
}
