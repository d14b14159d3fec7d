#version 330 core
// Cuts the interval of each eye ray to the rasterised bounds of its tile (stages/depth_bounds.frag). The
// interval becomes empty if no triangle was drawn over the tile.

#include "core/precision.glsl"
#include <streams>

uniform vec3 forward;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Rays ray = rays_load(pixel);
    Depth_bounds bounds = depth_bounds_load(pixel / TILE);
    // `along` is the depth per unit of t. It is positive, because the angle between each ray and `forward`
    // is less than 90 degrees. Each bound is widened by more than the division's rounding.
    float along = dot(ray.direction, forward);
    float far = min(bounds.closed, -bounds.minus_most);
    float t_min = max(ray.t_min, bounds.least / along * (1.0 - 1e-6));
    float t_max = min(ray.t_max, far / along * (1.0 + 1e-6));
    bool seen = bounds.least <= far && ray.t_min <= ray.t_max;
    bounded_store(Bounded(ray.origin, seen ? t_min : 1.0, ray.direction, seen ? t_max : -1.0));
}
