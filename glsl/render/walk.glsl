// Computes the pixel, the sample and the random numbers of the path at a texel. A wave is the set of paths
// traced at once: a block of texels for each pixel, a texel for each sample. If live paths were packed side
// by side (PACKED), the stream `came_from` holds the texel of each path before the packing.

#include "render/random.glsl"
#ifdef SOBOL
#include "render/sobol.glsl"
#endif

uniform ivec2 block;
uniform ivec2 corner;   // corner of the drawn region, in the picture
uniform int first_sample;
uniform int samples;    // samples in total; texels after the last sample hold no path
uniform int seed;

// The path's pixel in the whole picture. Random numbers depend on this pixel, not on the drawn region.
ivec2 walk_pixel(ivec2 texel) {
    return corner + texel / block;
}

int walk_sample(ivec2 texel) {
    ivec2 place = texel % block;
    return first_sample + place.y * block.x + place.x;
}

// Four random numbers for a vertex of the path; vertex 0 is the eye. `which` is 0 for the continuation, 1
// for the light sample. The first two numbers make choices, and the last two are a position.
vec4 walk_random(ivec2 texel, int vertex, uint which) {
#ifdef PACKED
    Came_from from = came_from_load(texel);
    texel = ivec2(from.x, from.y);
#endif
    uvec2 pixel = uvec2(walk_pixel(texel));
    uint path_sample = uint(walk_sample(texel));
#ifdef SOBOL
    return cell_middles(sobol_bits(pixel, path_sample, uint(vertex), which, uint(seed)));
#else
    return random_numbers(random_counter(pixel, path_sample, uint(vertex), which, uint(seed)));
#endif
}
