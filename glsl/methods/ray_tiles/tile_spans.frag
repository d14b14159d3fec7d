#version 330 core
// Computes the middle of the origins of a tile's rays, and the mean of their directions. The next pass puts
// a cone around the rays (methods/ray_tiles/tile_cones.frag). Any middle gives a correct cone, because the
// next pass measures the rays from this middle. 0.5 * lo + 0.5 * hi is finite even if hi - lo overflows.

#include "core/precision.glsl"
#include <streams>
#include "core/ray_tile.glsl"

void main() {
    vec3 lo = vec3(3.402823466e38);
    vec3 hi = -lo;
    vec3 axis = vec3(0.0);
    int live = 0;
    FOR_RAYS_OF_TILE(pixel) {
        Rays ray = rays_load(pixel);
        if (ray.t_min <= ray.t_max) {
            lo = min(lo, ray.origin);
            hi = max(hi, ray.origin);
            axis += normalize(ray.direction);
            ++live;
        }
    }
    // Directions that cancel out have no mean. Any axis then serves, because every cone around such
    // directions has a half-angle of about 90 degrees or more.
    axis = length(axis) > 0.001 * float(live) && live > 0 ? normalize(axis) : vec3(0.0, 0.0, 1.0);
    tile_span_store(Tile_span(live > 0 ? 0.5 * lo + 0.5 * hi : vec3(0.0), live, axis));
}
