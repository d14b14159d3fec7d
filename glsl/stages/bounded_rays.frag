#version 330 core
// Eye rays with the ends that rasterised bounds give them (stages/depth_bounds.frag); empty where no
// triangle was drawn.

#include "core/precision.glsl"
#include <streams>

uniform vec3 forward;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Rays ray = rays_load(pixel);
    Depth_bounds bounds = depth_bounds_load(pixel / TILE);
    // Depth a unit of t. Pixels' directions are within a right angle of the view; each bound is
    // taken a little wider than the rounding of the few operations from depth to t.
    float along = dot(ray.direction, forward);
    float far = min(bounds.closed, -bounds.minus_most);
    float t_min = max(ray.t_min, bounds.least / along * (1.0 - 1e-6));
    float t_max = min(ray.t_max, far / along * (1.0 + 1e-6));
    bool seen = bounds.least <= far && ray.t_min <= ray.t_max;
    bounded_store(Bounded(ray.origin, seen ? t_min : 1.0, ray.direction, seen ? t_max : -1.0));
}
