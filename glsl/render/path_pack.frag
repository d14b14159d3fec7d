#version 330 core
// Copy the live paths of a wave (the paths traced at once) side by side into smaller textures. A copy holds
// the path's ray and weight, the light gathered so far, and the texel that the path came from. Texels after
// the last live path get an empty ray.

#include "core/precision.glsl"
#include <streams>
#include "core/fetch.glsl"
#include "stages/sorted_place.glsl"

uniform int squares_a_row;       // squares (sorted_place.glsl) per row of the target textures
uniform int from_squares_a_row;  // squares per row of the source textures
uniform int kept;                // number of live paths

void main() {
    int place = sorted_place(ivec2(gl_FragCoord.xy), squares_a_row);
    int source = source_load(table_texel(min(place, kept - 1))).index;
    ivec2 texel = sorted_pixel(source, from_squares_a_row);
    Rays ray = rays_load(texel);
    Walk walk = walk_load(texel);
    if (place >= kept) {
        ray = Rays(vec3(0.0), 1.0, vec3(0.0, 0.0, 1.0), -1.0);
        walk = Walk(vec3(0.0), 0.0);
    }
    rays_store(ray);
    walk_store(walk);
    radiance_store(radiance_load(texel));
#ifdef PACKED
    came_from_store(came_from_load(texel));
#else
    came_from_store(Came_from(texel.x, texel.y));
#endif
}
