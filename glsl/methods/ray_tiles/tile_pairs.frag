#version 330 core
// A ray of a tile against the triangle whose quad is drawn over it. MIN blending keeps the nearest
// t; a second time over, with `equal`, those at just that t leave their index, and MIN blending keeps
// the lowest. One program does both, so that t cannot differ between them. Under ANY_HIT the first
// time is the only one and leaves an index. With COUNTING, quads are counted by additive blending.

#include "core/precision.glsl"
#include "core/fetch.glsl"
#include <streams>
#include <tables>
#include "core/stats.glsl"
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/hit.glsl"
#include "core/triangle.glsl"

uniform bool equal;

flat in int triangle;

out vec4 value;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Rays texels = rays_load(pixel);
    if (!(texels.t_min <= texels.t_max)) {
        discard;
    }
#ifdef COUNTING
    value = vec4(equal ? 0.0 : 1.0, 1.0, 0.0, 0.0);
#else
    Ray ray = ray_setup(texels);
    Hit hit = no_hit(ray.t_max);
    test_triangle(ray, triangle, hit);
    if (!hit_found(hit)) {
        discard;
    }
#ifdef ANY_HIT
    value = vec4(float(hit.triangle));
#else
    float t = stored(hit.t);
    if (equal && t != nearest_load(pixel).t) {
        discard;
    }
    value = vec4(equal ? float(hit.triangle) : t);
#endif
#endif
}
