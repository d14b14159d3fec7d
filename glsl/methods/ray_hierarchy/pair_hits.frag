#version 330 core
// Tests the last pairs of the traversal, each a single ray and a triangle. Writes a hit that is nearer than
// the ray's hit so far; otherwise writes t = infinity.

#include "core/precision.glsl"
#include "core/stream.glsl"
#include <streams>
#include <tables>
#include "core/stats.glsl"
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/hit.glsl"
#include "core/triangle.glsl"

uniform int base;

void main() {
    Pair pair = pair_load(table_texel(base + element()));
    ivec2 pixel = ivec2(pair.x, pair.y);
    Hit before = hit_load(pixel);
    Hit hit = before;
    test_triangle(ray_setup(rays_load(pixel)), pair.triangle, hit);
    bool found = hit.triangle != before.triangle;
    tested_store(Tested(found ? stored(hit.t) : 1.0 / 0.0, found ? pair.triangle : -1,
                              pair.x, pair.y));
}
