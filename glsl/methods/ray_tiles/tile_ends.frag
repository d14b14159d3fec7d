#version 330 core
// Computes how far the rays of a tile still search. A ray ends at its nearest hit among the batches of
// triangles so far; under ANY_HIT a ray with a hit no longer searches. LONGER and FURTHER lengthen t, which
// storage or arithmetic in a narrow format may have shortened.

#include "core/precision.glsl"
#include <streams>
#include "core/hit.glsl"
#include "core/ray_tile.glsl"

#if defined(STORAGE_FORMAT) && defined(ARITHMETIC_FORMAT)
const float LONGER = 1.0 + 4.0 * max(STORAGE_UNIT, ARITHMETIC_UNIT);
const float FURTHER = 2.5e-7;    // for numbers too small for the full precision of fp16
#elif defined(STORAGE_FORMAT)
const float LONGER = 1.0 + 4.0 * STORAGE_UNIT;
const float FURTHER = 2.5e-7;
#elif defined(ARITHMETIC_FORMAT)
const float LONGER = 1.0 + 4.0 * ARITHMETIC_UNIT;
const float FURTHER = 2.5e-7;
#else
const float LONGER = 1.0 + 4.0 * ARITHMETIC_UNIT;
const float FURTHER = 0.0;
#endif

void main() {
    Tile_end end = Tile_end(-1.0, 0);
    FOR_RAYS_OF_TILE(pixel) {
        Rays ray = rays_load(pixel);
        bool searches = ray.t_min <= ray.t_max;
#ifdef ANY_HIT
        float t = ray.t_max;
        searches = searches && found_load(pixel).triangle == NO_TRIANGLE;
#else
        float t = min(ray.t_max, nearest_load(pixel).t);
#endif
        if (searches) {
            t = max(t, -ray.t_min) * LONGER + FURTHER;
            end.reach = max(end.reach, t * length(ray.direction));
            end.lines = ray.t_min < 0.0 ? 1 : end.lines;
        }
    }
    tile_end_store(end);
}
