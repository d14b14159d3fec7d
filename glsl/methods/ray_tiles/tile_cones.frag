#version 330 core
// Computes the cone around a tile's rays (methods/ray_tiles/cone.glsl), in the second of two passes, after
// tile_spans.frag. Other methods widen boxes by a slack, because the triangle test rounds
// (core/slack.glsl). Here the cone's radius grows instead by sqrt(3) times the largest slack. This growth
// covers the slack on all three axes.

#include "core/precision.glsl"
#include <streams>
#include "core/slack.glsl"
#include "methods/ray_tiles/cone.glsl"
#include "core/ray_tile.glsl"

const float COSINE_MARGIN = 16.0 * 5.9604645e-8;   // above the error of two unit vectors and their dot product

void main() {
    Tile_span span = tile_span_load(ivec2(gl_FragCoord.xy));
    float radius = 0.0;
    float cosine = 1.0;
    FOR_RAYS_OF_TILE(pixel) {
        Rays ray = rays_load(pixel);
        if (ray.t_min <= ray.t_max) {
            float away = length_above(ray.origin - span.centre);
            radius = max(radius, away + 1.7320509 * largest(box_slack(ray.origin)));
            cosine = min(cosine, dot(normalize(ray.direction), span.axis));
        }
    }
    tile_cone_store(Tile_cone(span.centre, radius * (1.0 + MARGIN), span.axis,
                              cosine - COSINE_MARGIN));
}
