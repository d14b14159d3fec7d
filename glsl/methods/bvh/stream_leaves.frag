#version 330 core
// Tests all triangles of a leaf for one element of a ray stream. One pass suffices, because builders limit
// the number of triangles in a leaf.

#include "core/precision.glsl"
#include "core/stream.glsl"
#include <streams>
#include <tables>
#include "core/stats.glsl"
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/hit.glsl"
#include "core/triangle.glsl"
#include "core/quantised.glsl"
#include "methods/bvh/bvh_pairs.glsl"

void main() {
    Queued at = queued_load(table_texel(element()));
    ivec2 pixel = ivec2(at.x, at.y);
    Ray ray = ray_setup(rays_load(pixel));
    Hit before = hit_load(pixel);
    Hit hit = before;
    int next = first_triangle(at.child);
    int tests = 0;
    do {
        test_triangle(ray, next, hit);
        hit.t = stored(hit.t);
        next = triangle_last(next) != 0 ? -1 : next + 1;
        ++tests;
    } while (next >= 0 && !search_over(hit));
    bool found = hit.triangle != before.triangle;
    tested_store(Tested(found ? hit.t : 1.0 / 0.0, found ? hit.triangle : -1, at.x, at.y));
    met_store(Met(hit.u, hit.v, tests));
}
