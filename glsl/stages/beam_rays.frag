#version 330 core
// Computes the beam around the rays of each tile that have a non-empty interval (stages/tile_beam.glsl).
// These beams are the lowest level; stages/beam_level.frag computes the levels above.

#include "core/precision.glsl"
#include "core/fetch.glsl"
#include <streams>
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/ray_tile.glsl"
#include "stages/tile_beam.glsl"

void main() {
    Tile_beam beam = no_beam();
    FOR_RAYS_OF_TILE(pixel) {
        Ray ray = ray_setup(rays_load(pixel));
        bvec3 minus = lessThan(ray.inv_dir, vec3(0.0));
        int negative = int(minus.x) + 2 * int(minus.y) + 4 * int(minus.z);
        Tile_beam one = Tile_beam(ray.lo_origin, ray.t_min, ray.hi_origin, ray.t_max,
                                  ray.inv_dir, negative | (7 - negative) << 3, ray.inv_dir, 1);
        if (ray.t_min <= ray.t_max) {
            beam = joined(beam, one);
        }
    }
    tile_beam_store(beam);
}
