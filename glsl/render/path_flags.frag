#version 330 core
// Whether a texel holds a path that goes on, in the order of squares of texels: what a scan begins
// with. Squares may stand out over the edge.

#include <streams>
#include "core/stream.glsl"
#include "stages/sorted_place.glsl"

uniform ivec2 size;         // of the textures
uniform int squares_a_row;   // squares of them

void main() {
    ivec2 texel = sorted_pixel(element(), squares_a_row);
    bool inside = all(lessThan(texel, size));
    bool live = inside && walk_load(min(texel, size - 1)).weight != vec3(0.0);
    values_store(Values(vec4(live ? 1.0 : 0.0, 0.0, 0.0, 0.0)));
}
