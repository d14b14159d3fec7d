// What the programs of Zhou's kd-tree build share: K. Zhou, Q. Hou, R. Wang, B. Guo, "Real-Time
// KD-Tree Construction on Graphics Hardware", SIGGRAPH Asia 2008 (survey, section 3.4.5). They
// compute what gpgpu_rt/accel/zhou.py computes, operation by operation, and its header says where
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

// Masks of 64 bits ------------------------------------------------------------------------------

int population(vec4 mask) {
    uvec4 n = uvec4(mask);
    n -= (n >> 1) & 0x5555u;
    n = (n & 0x3333u) + ((n >> 2) & 0x3333u);
    n = (n + (n >> 4)) & 0x0f0fu;
    n = (n + (n >> 8)) & 0x1fu;
    return int(n.x + n.y + n.z + n.w);
}

bool has_bit(vec4 mask, int bit) {
    return ((uint(mask[bit >> 4]) >> (bit & 15)) & 1u) != 0u;
}

vec4 common_bits(vec4 a, vec4 b) {
    return vec4(uvec4(a) & uvec4(b));
}

// The lowest `count` bits.
vec4 lowest_bits(int count) {
    ivec4 bits = clamp(count - ivec4(0, 16, 32, 48), 0, 16);
    return vec4((uvec4(1u) << uvec4(bits)) - 1u);
}

// The place of the set bit that `rank` others stand below.
int nth_bit(vec4 mask, int rank) {
    int bit = 0;
    for (; bit < 64; ++bit) {
        if (has_bit(mask, bit) && rank-- == 0) {
            break;
        }
    }
    return bit;
}
