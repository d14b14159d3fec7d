#version 330 core
// Flag the texels that hold a live path, for a scan. The flags are in the order of squares of texels
// (stages/sorted_place.glsl). A square may extend beyond the edge of the texture.

#include <streams>
#include "core/stream.glsl"
#include "stages/sorted_place.glsl"

uniform ivec2 size;         // size of the textures
uniform int squares_a_row;   // squares per row of the textures

void main() {
    ivec2 texel = sorted_pixel(element(), squares_a_row);
    bool inside = all(lessThan(texel, size));
    bool live = inside && walk_load(min(texel, size - 1)).weight != vec3(0.0);
    values_store(Values(vec4(live ? 1.0 : 0.0, 0.0, 0.0, 0.0)));
}
