#version 330 core
// A tile's rays, first of two passes: the middle of their origins and of their directions, which the
// cone (methods/ray_tiles/tile_cones.frag) is laid around. Any middle would do: the second pass measures from
// it. Origins that differ by more than floats reach have a middle yet.

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
    // Directions that cancel out have no middle: the cone is then everything, around any axis.
    axis = length(axis) > 0.001 * float(live) && live > 0 ? normalize(axis) : vec3(0.0, 0.0, 1.0);
    tile_span_store(Tile_span(live > 0 ? 0.5 * lo + 0.5 * hi : vec3(0.0), live, axis));
}
