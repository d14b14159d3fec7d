// Shared code of the programs of Zhou's kd-tree build: K. Zhou, Q. Hou, R. Wang, B. Guo, "Real-Time KD-Tree
// Construction on Graphics Hardware", SIGGRAPH Asia 2008 (survey, section 5). The programs compute the same
// operations as gpgpu_rt/methods/kdtree/zhou.py, whose header lists the departures from the paper. A piece
// (in zhou.py: a reference) is the part of a triangle in a node. Counts and ranks are integers below 2^24,
// which the textures' floats represent exactly.

// Defines a function that returns the first i in [lo, hi) such that elements 0 to i hold more than `rank`
// items. LOAD reads the elements' prefix sums.
#define FIND_OWNER(NAME, LOAD) int NAME(int rank, int channel, int lo, int hi) { \
    while (lo < hi) { \
        int middle = (lo + hi) >> 1; \
        if (LOAD(table_texel(middle + 1)).value[channel] > float(rank)) { \
            hi = middle; \
        } else { \
            lo = middle + 1; \
        } \
    } \
    return lo; \
}

#define INFINITY uintBitsToFloat(0x7f800000u)

// Masks of 64 bits. Textures hold a mask as four numbers of 16 bits; programs compute with two words.

uvec2 mask_bits(vec4 mask) {
    uvec4 m = uvec4(mask);
    return m.xz | m.yw << 16;
}

vec4 mask_floats(uvec2 mask) {
    return vec4(mask.x & 0xffffu, mask.x >> 16, mask.y & 0xffffu, mask.y >> 16);
}

int population(uvec2 n) {
    n -= (n >> 1) & 0x55555555u;
    n = (n & 0x33333333u) + ((n >> 2) & 0x33333333u);
    n = (n + (n >> 4)) & 0x0f0f0f0fu;
    n = (n * 0x01010101u) >> 24;
    return int(n.x + n.y);
}

// Remove the lowest set bit of a mask that is not 0. Return its position, read from a float's exponent.
int take_bit(inout uvec2 mask) {
    bool low = mask.x != 0u;
    uint word = low ? mask.x : mask.y;
    uint bit = word & (~word + 1u);
    mask.x ^= low ? bit : 0u;
    mask.y ^= low ? 0u : bit;
    return (floatBitsToInt(float(bit)) >> 23) - 127 + (low ? 0 : 32);
}
