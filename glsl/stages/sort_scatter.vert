#version 330 core
// Draws a point for each sorted ray, at the ray's original place in the unsorted textures.

#include <sources>
#include "core/fetch.glsl"
#include "stages/sorted_place.glsl"

uniform ivec2 ray_texture_size;
uniform int squares_a_row;

flat out ivec2 source;

void main() {
    int i = sort_key_load(table_texel(gl_VertexID)).index;
    source = sorted_pixel(gl_VertexID, squares_a_row);
    vec2 pixel = vec2(i % ray_texture_size.x, i / ray_texture_size.x) + 0.5;
    gl_Position = vec4(2.0 * pixel / vec2(ray_texture_size) - 1.0, 0.0, 1.0);
}
