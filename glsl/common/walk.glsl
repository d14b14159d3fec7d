// Which path a texel is: a wave holds a block of texels for each pixel, a sample each.

uniform ivec2 block;
uniform int first_sample;
uniform int samples;    // there are in all: texels past the last one hold no path
uniform int seed;

ivec2 walk_pixel(ivec2 texel) {
    return texel / block;
}

int walk_sample(ivec2 texel) {
    ivec2 place = texel - block * walk_pixel(texel);
    return first_sample + place.y * block.x + place.x;
}

// The numbers of an event of its path: vertex 0 is the eye.
vec4 walk_random(ivec2 texel, int vertex, uint which) {
    return random_numbers(random_counter(uvec2(walk_pixel(texel)), uint(walk_sample(texel)),
                                         uint(vertex), which, uint(seed)));
}
