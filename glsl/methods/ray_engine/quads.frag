#version 330 core
// Tests one pair of a ray and a triangle in each fragment: Carr, Hall, Hart 2002 (see
// methods/ray_engine/ray_engine.glsl). Blending or the depth test reduces the fragments of a ray to one
// result:
//   `KEEP_NEAREST` writes t. MIN blending keeps the smallest t.
//   `KEEP_FIRST` writes the triangle if its t equals the smallest t. MIN blending keeps the lowest index.
//   `KEEP_DEPTH` writes the triangle, and t as depth. Among equally near triangles, the depth test keeps
//   the triangle that is drawn first.

#include "core/precision.glsl"
#include <streams>
#include "core/stats.glsl"
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/hit.glsl"
#include <method>
#include <pair_test>

uniform float depth_end;   // the t at depth 1
const float DEPTH_STEPS = 16777215.0;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Ray ray = ray_setup(rays_load(pixel));
    Hit hit = no_hit(ray.t_max);
    test_pair(ray, quad_triangle, hit);
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
    // Round depth to 24 bits, so that depth buffers with more bits keep the same triangle.
    gl_FragDepth = round(clamp(t / depth_end, 0.0, 1.0) * DEPTH_STEPS) / DEPTH_STEPS;
    found_store(Found(hit.triangle));
#endif
}
