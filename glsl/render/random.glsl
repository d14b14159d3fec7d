// Random numbers without a state (Salmon, Moraes, Dror and Shaw, "Parallel Random Numbers: As Easy as 1, 2,
// 3", SC 2011): each number is an integer hash of pixel, sample, bounce and purpose. So every method,
// schedule and order of passes draws the same numbers. The hash is pcg4d of Jarzynski and Olano, "Hash
// Functions for GPU Rendering", JCGT 9(3), 2020. Philox of Salmon et al. needs the high half of a product,
// which GLSL 330 lacks. gpgpu_rt/reference/random_numbers.py draws the same numbers.

// Return the counter of a block of four numbers: the pixel, the sample, and a word that packs the seed, the
// bounce and the block. Each purpose has its own block. The word has space for 16 blocks per bounce, 4096
// bounces and 65536 seeds.
uvec4 random_counter(uvec2 pixel, uint path_sample, uint bounce, uint block, uint seed) {
    return uvec4(pixel, path_sample, (seed << 16) | (bounce << 4) | block);
}

uvec4 random_bits(uvec4 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// Map each number to the centre of one of 2^23 equal cells of (0, 1), exact in float32. No result is 0, so
// logarithms need no guard.
vec4 cell_middles(uvec4 bits) {
    return (vec4(bits >> 9) + 0.5) * 1.1920928955078125e-7;
}

vec4 random_numbers(uvec4 counter) {
    return cell_middles(random_bits(counter));
}
