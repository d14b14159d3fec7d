#version 330 core
// A triangle that may be hit before what the rasteriser shows: looked at in the pixels it covers if
// those are few, else left to be drawn (see first_rival.vert). What the rasteriser got right passes no
// ray to the test: the loop inside goes on to the next pixel where another triangle is shown that
// this one may come before.

#include "common/precision.glsl"
#include <streams>
#include "common/stream.glsl"
#include <tables>
#include "common/stats.glsl"
#include "common/slack.glsl"
#include "common/ray.glsl"
#include "common/hit.glsl"
#include "common/triangle.glsl"
#include "common/cover.glsl"

uniform sampler2D rows;

out float rival;

// Twice the area that an edge spans with a point, if it counts up to the inside.
float side(vec2 from, vec2 to, vec2 point, float turn) {
    vec2 edge = to - from;
    vec2 way = point - from;
    return turn * (edge.x * way.y - edge.y * way.x);
}

void main() {
    int i = int(texelFetch(rows, table_texel(element()), 0).x);
    int index = triangle_index(i);
    Cover cover = cover_of(triangle_v0(i), triangle_v1(i), triangle_v2(i));
    ivec4 pixels = covered_pixels(cover);
    ivec2 extent = pixels.zw - pixels.xy + 1;
    int left = max(extent.x, 0) * max(extent.y, 0);
    bool many = cover.unbounded || left > MOST_PIXELS;
    left = many || cover.outside ? 0 : left;

    float area = side(cover.a, cover.b, cover.c, 1.0);
    float turn = area < 0.0 ? -1.0 : 1.0;
    float reach = length(vec2(extent)) + 4.0 * cover.margin;
    vec3 edges = vec3(distance(cover.a, cover.b), distance(cover.b, cover.c), distance(cover.c, cover.a));
    vec3 least = -(cover.margin * edges + 4.0 * (cover.eta + 1e-3) * reach);
    bool before = false;
    ivec2 next = pixels.xy;
    while (left > 0 && !before) {
        ivec2 pixel = next;
        Hit shown = no_hit(0.0);
        bool asked = false;
        while (left > 0 && !asked) {
            pixel = next;
            next = next.x < pixels.z ? ivec2(next.x + 1, next.y) : ivec2(pixels.x, next.y + 1);
            --left;
            vec2 centre = vec2(pixel) + 0.5;
            shown = hit_load(pixel);
            asked = shown.triangle != index && cover.depth * slant(centre) <= shown.t
                && side(cover.a, cover.b, centre, turn) >= least.x
                && side(cover.b, cover.c, centre, turn) >= least.y
                && side(cover.c, cover.a, centre, turn) >= least.z;
        }
        Hit hit = shown;
        test_triangle(ray_setup(rays_load(pixel)), i, hit);
        before = asked && hit.triangle != shown.triangle;
    }
    rival = many || before ? 1.0 : 0.0;
}
