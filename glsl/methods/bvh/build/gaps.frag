#version 330 core
// Finds the inner nodes of the binary tree over the sorted Morton codes (Lauterbach et al. 2009). Each gap
// between two neighbouring slots of the sorted order is a candidate for an inner node, which spans slots
// around the gap (radix.glsl). A search with doubling steps and then with halving steps finds the two ends
// of the span.
//
// A gap inside a leaf is dropped. Without MOST_BITS, a gap is kept if its node spans more than max_leaf
// triangles. With MOST_BITS, for the clusters of the hybrid build, a gap is kept if the codes of its two
// neighbouring slots share fewer than MOST_BITS bits.

#include <records>
#include "core/stream.glsl"
#include "methods/bvh/build/radix.glsl"

uniform int max_leaf;

// Starting at slot i, return the last slot in `direction` that shares at least `bits` bits with slot i.
int reach(int i, int direction, int bits) {
    ivec2 code = slot_code(i);
    int width = 1;
    while (shared_bits(code, i, i + direction * width) >= bits) {
        width <<= 1;
    }
    int at = width >> 1;
    for (int more = width >> 2; more > 0; more >>= 1) {
        if (shared_bits(code, i, i + direction * (at + more)) >= bits) {
            at += more;
        }
    }
    return i + direction * at;
}

void main() {
    int gap = element();
    int bits = gap_bits(gap);
    int first = reach(gap, -1, bits), last = reach(gap, 1, bits);
#ifdef MOST_BITS
    bool kept = bits < MOST_BITS;
#else
    bool kept = last - first >= max_leaf;
#endif
    int parent = parent_gap(first, last);
    interval_store(Interval(kept ? first : -1, last, parent, int(parent == last)));
}
