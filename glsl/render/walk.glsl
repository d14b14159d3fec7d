// Which path a texel is: a wave holds a block of texels for each pixel, a sample each. Where paths are
// packed, a stream says which of them a path came from.

#include "render/random.glsl"
#ifdef SOBOL
#include "render/sobol.glsl"
#endif

uniform ivec2 block;
uniform ivec2 corner;   // of what is drawn, in the picture
uniform int first_sample;
uniform int samples;    // there are in all: texels past the last one hold no path
uniform int seed;

// Its pixel of the picture: random numbers are that one's, whatever part is drawn.
ivec2 walk_pixel(ivec2 texel) {
    return corner + texel / block;
}

int walk_sample(ivec2 texel) {
    ivec2 place = texel % block;
    return first_sample + place.y * block.x + place.x;
}

// The numbers of an event of its path, block 0 for where it goes and 1 for the light that it asks: two
// that pick, two for a place. Vertex 0 is the eye.
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
