#version 330 core
// path_pack.frag has copied the live paths of a wave (the paths traced at once) side by side into smaller
// textures. Place a point for each packed path at the texel that the path came from, for bring_back.frag.

#include <sources>
#include "stages/sorted_place.glsl"

uniform ivec2 size;         // size of the wave's textures
uniform int squares_a_row;   // squares (sorted_place.glsl) per row of the packed paths' textures

flat out ivec2 source;

void main() {
    source = sorted_pixel(gl_VertexID, squares_a_row);
    Came_from from = came_from_load(source);
    gl_Position = vec4(2.0 * (vec2(from.x, from.y) + 0.5) / vec2(size) - 1.0, 0.0, 1.0);
}
