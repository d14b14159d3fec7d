// What the programs of Zhou's kd-tree build share: K. Zhou, Q. Hou, R. Wang, B. Guo, "Real-Time
// KD-Tree Construction on Graphics Hardware", SIGGRAPH Asia 2008 (survey, section 5). They
// compute what gpgpu_rt/methods/kdtree/zhou.py computes, operation by operation, and its header says where
// both depart from the paper. Counts, ranks and masks are held in floats: integers below 2^24, and
// 64 bits as four channels of 16.

// The first of [lo, hi) behind whose end more than `rank` are counted, in prefix sums that LOAD reads.
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

// Masks of 64 bits: in textures four numbers of 16 bits, at work two of 32.

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

// Takes the lowest bit out of a mask that has one; its place, from its exponent as a float.
int take_bit(inout uvec2 mask) {
    bool low = mask.x != 0u;
    uint word = low ? mask.x : mask.y;
    uint bit = word & (~word + 1u);
    mask.x ^= low ? bit : 0u;
    mask.y ^= low ? 0u : bit;
    return (floatBitsToInt(float(bit)) >> 23) - 127 + (low ? 0 : 32);
}
