#version 330 core
// Tests a ray of a tile against the triangle whose quad covers the tile.
//
// In the first draw MIN blending keeps the nearest t. In the second draw, with `equal`, triangles at
// exactly this t write their index, and MIN blending keeps the lowest index. The same program serves both
// draws, so t cannot differ. Under ANY_HIT there is only the first draw, and it writes an index. With
// COUNTING, additive blending counts the quads and the triangle tests.

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

Hit found_by(Rays texels) {
    Ray ray = ray_setup(texels);
    Hit hit = no_hit(ray.t_max);
    test_triangle(ray, triangle, hit);
    if (!hit_found(hit)) {
        discard;
    }
    return hit;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Rays texels = rays_load(pixel);
    if (!(texels.t_min <= texels.t_max)) {
        discard;
    }
#if defined(COUNTING)
    value = vec4(equal ? 0.0 : 1.0, 1.0, 0.0, 0.0);
#elif defined(ANY_HIT)
    value = vec4(float(found_by(texels).triangle));
#else
    Hit hit = found_by(texels);
    float t = stored(hit.t);
    if (equal && t != nearest_load(pixel).t) {
        discard;
    }
    value = vec4(equal ? float(hit.triangle) : t);
#endif
}
