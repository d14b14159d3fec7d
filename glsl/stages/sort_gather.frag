#version 330 core
// Gathers the rays in the order of their sort keys. Texels past the last ray get an empty ray.

#include "core/precision.glsl"
#include "core/fetch.glsl"
#include <streams>
#include "stages/sorted_place.glsl"

uniform ivec2 ray_texture_size;   // size of the texture of the unsorted rays
uniform int squares_a_row;
uniform int elements;

void main() {
    int place = sorted_place(ivec2(gl_FragCoord.xy), squares_a_row);
    int i = sort_key_load(table_texel(min(place, elements - 1))).index;
    Rays ray = rays_load(ivec2(i % ray_texture_size.x, i / ray_texture_size.x));
    if (place >= elements) {
        ray.origin = vec3(0.0);
        ray.direction = vec3(0.0, 0.0, 1.0);
        ray.t_min = 1.0;
        ray.t_max = -1.0;
    }
    rays_store(ray);
}
