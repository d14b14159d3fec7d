// Low-discrepancy numbers: Sobol' points in four dimensions, shuffled and Owen-scrambled with integer
// operations. The keys of the scrambling are hashes of pixel, bounce and dimension. The samples of a pixel
// are spread evenly; the points of different pixels and bounces are independent. B. Burley, "Practical
// Hash-based Owen Scrambling", JCGT 9(4), 2020. The permutation is by Laine and Karras, "Stratified
// Sampling for Stochastic Transparency", 2011, with Burley's constants.
//
// Departures: the keys come from the hash of random.glsl. The direction numbers of dimensions 2 and 3 (Joe
// and Kuo 2008) come from their recurrences instead of a table. gpgpu_rt/reference/sobol.py computes the
// same bits.

#include "render/random.glsl"

uint reversed(uint x) {
    x = (x << 16) | (x >> 16);
    x = ((x & 0x00ff00ffu) << 8) | ((x >> 8) & 0x00ff00ffu);
    x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
    x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
    return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

// A permutation that keeps or flips each bit. Only the key and the bits below a bit decide on its flip.
// Applied to a number with reversed bits, the permutation is an Owen scrambling.
uint permuted(uint x, uint key) {
    x += key;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return x;
}

// The index of the Sobol' point of a sample. An aligned block of 2^k samples gets an aligned block of 2^k
// points in a shuffled order. The upper 16 bits do not change. For fewer than 65536 samples these bits are
// zero, so the loop in sobol_next_two ends after at most 16 iterations.
uint shuffled(uint path_sample, uint key) {
    return (reversed(permuted(reversed(path_sample), key)) & 0xffffu) | (path_sample & 0xffff0000u);
}

// The first two coordinates of point i. The bits of a coordinate are in reversed order: the lowest bit has
// the value 1/2. The second coordinate is i times the matrix of Pascal's triangle modulo 2, a Kronecker
// product of five 2x2 matrices.
uvec2 sobol_first_two(uint i) {
    uint x = i ^ ((i & 0xaaaaaaaau) >> 1);
    x ^= (x & 0xccccccccu) >> 2;
    x ^= (x & 0xf0f0f0f0u) >> 4;
    x ^= (x & 0xff00ff00u) >> 8;
    return uvec2(i, x ^ (x >> 16));
}

uvec2 sobol_next_two(uint i) {
    uvec2 sum = uvec2(0u);
    uvec2 second = uvec2(1u, 3u);           // direction numbers: the current number and its successors
    uvec3 third = uvec3(1u, 3u, 4u);
    for (uint rest = i; rest != 0u; rest >>= 1) {
        sum ^= (rest & 1u) * uvec2(second.x, third.x);
        second = uvec2(second.y, second.y ^ second.x ^ (second.x << 2));
        third = uvec3(third.yz, third.y ^ third.x ^ (third.x << 3));
    }
    return sum;
}

uvec4 sobol_keys(uvec2 pixel, uint bounce, uint block, uint seed) {
    return random_bits(random_counter(pixel, 0xffffffffu, bounce, block, seed));   // for all samples
}

uint scrambled(uint bits, uint key) {
    return reversed(permuted(bits, key));
}

// Four numbers for block 0 (the path's next direction) or block 1 (the light sample) of a bounce, in place
// of random_numbers. The first two numbers make choices, and the last two are a position. The position of
// block 0 and the position of block 1 one bounce later are the four coordinates of one Sobol' point.
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
