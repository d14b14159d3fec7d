#version 330 core
// Computes the beam around FAN x FAN beams of the level below (stages/tile_beam.glsl).

#include "core/precision.glsl"
#include <streams>
#include "stages/tile_beam.glsl"

uniform ivec2 below_size;

void main() {
    ivec2 lo = FAN * ivec2(gl_FragCoord.xy);
    ivec2 hi = min(lo + FAN, below_size);
    Tile_beam beam = no_beam();
    for (int y = lo.y; y < hi.y; ++y) {
        for (int x = lo.x; x < hi.x; ++x) {
            beam = joined(beam, tile_beam_load(ivec2(x, y)));
        }
    }
    tile_beam_store(beam);
}
