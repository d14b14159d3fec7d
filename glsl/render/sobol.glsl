// Low-discrepancy numbers: Sobol' points in four dimensions, shuffled, and scrambled as Owen does, in
// integers, by keys hashed from the pixel, the event and the dimension that they are for. Samples of a
// pixel are spread evenly; those of other pixels and events know nothing of them. B. Burley,
// "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020; the permutation is that of Laine and
// Karras, "Stratified Sampling for Stochastic Transparency", 2011, with his constants. The survey has
// no section on it.
//
// Where we depart: keys are hashed by random.glsl; the directions of dimensions 2 and 3 (Joe and Kuo
// 2008) come from their recurrences on the way, instead of a table; and what stands together in four
// dimensions is a direction and the light that is asked where it leads. The twin of
// gpgpu_rt/reference/sobol.py, to the bit.

#include "render/random.glsl"

uint reversed(uint x) {
    x = (x << 16) | (x >> 16);
    x = ((x & 0x00ff00ffu) << 8) | ((x >> 8) & 0x00ff00ffu);
    x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
    x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
    return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

// Changes each bit by those below it alone: of reversed bits, a scrambling as Owen's.
uint permuted(uint x, uint key) {
    x += key;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return x;
}

// Which point a sample takes: aligned blocks of 2^k samples take aligned blocks of 2^k points, in an
// order of their own. Upper halves stay, so that a point adds few directions.
uint shuffled(uint path_sample, uint key) {
    return (reversed(permuted(reversed(path_sample), key)) & 0xffffu) | (path_sample & 0xffff0000u);
}

// Point i, with the bits of its coordinates reversed: the lowest is worth 1/2. The second coordinate
// is i times Pascal's triangle modulo 2, which is a Kronecker product of five of two rows.
uvec2 sobol_first_two(uint i) {
    uint x = i ^ ((i & 0xaaaaaaaau) >> 1);
    x ^= (x & 0xccccccccu) >> 2;
    x ^= (x & 0xf0f0f0f0u) >> 4;
    x ^= (x & 0xff00ff00u) >> 8;
    return uvec2(i, x ^ (x >> 16));
}

uvec2 sobol_next_two(uint i) {
    uvec2 sum = uvec2(0u);
    uvec2 second = uvec2(1u, 3u);           // directions, this one and those after it
    uvec3 third = uvec3(1u, 3u, 4u);
    for (uint rest = i; rest != 0u; rest >>= 1) {
        sum ^= (rest & 1u) * uvec2(second.x, third.x);
        second = uvec2(second.y, second.y ^ second.x ^ (second.x << 2));
        third = uvec3(third.yz, third.y ^ third.x ^ (third.x << 3));
    }
    return sum;
}

uvec4 sobol_keys(uvec2 pixel, uint bounce, uint block, uint seed) {
    return random_bits(random_counter(pixel, 0xffffffffu, bounce, block, seed));    // no sample's
}

uint scrambled(uint bits, uint key) {
    return reversed(permuted(bits, key));
}

// What random_numbers draws as block 0 or 1 of a bounce, low-discrepancy: two numbers that pick, and
// two for a place. The places of block 0, and those of block 1 a bounce later, are one point.
uvec4 sobol_bits(uvec2 pixel, uint path_sample, uint bounce, uint block, uint seed) {
    uvec4 pick_keys = sobol_keys(pixel, bounce, 2u + block, seed);
    uvec2 pick = sobol_first_two(shuffled(path_sample, pick_keys.x));
    uvec4 keys = sobol_keys(pixel, bounce - block, 4u, seed);
    uint i = shuffled(path_sample, keys.x);
    uvec2 place = sobol_first_two(i);
    if (block == 1u) {
        place = sobol_next_two(i);
        keys = sobol_keys(pixel, bounce - 1u, 5u, seed);
    }
    return uvec4(scrambled(pick.x, pick_keys.y), scrambled(pick.y, pick_keys.z),
                 scrambled(place.x, keys.y), scrambled(place.y, keys.z));
}
