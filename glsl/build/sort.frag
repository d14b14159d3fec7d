#version 330 core
// A step of bitonic merge sort (Batcher 1968; as fragment passes Purcell et al. 2003, and P. Kipfer,
// R. Westermann, "Improved GPU Sorting", GPU Gems 2, 2005): every element looks at one partner and
// keeps the smaller of the two, or the larger one.
//
// Departure: the first step of each merge mirrors a block instead of shifting it, so that all steps
// put the smaller one first. Elements past the end count as the largest ones and stay where they
// are, so that any number can be sorted.

#include <records>
#include "common/stream.glsl"

uniform int elements;
uniform int flip;   // bits in which the partner's place differs

bool before(Sort_key a, Sort_key b) {
    if (a.hi != b.hi) {
        return a.hi < b.hi;
    }
    return a.lo < b.lo || (a.lo == b.lo && a.index < b.index);
}

void main() {
    int i = element();
    int partner = i ^ flip;
    Sort_key kept = sort_key_load(table_texel(i));
    if (partner < elements) {
        Sort_key other = sort_key_load(table_texel(partner));
        if (before(other, kept) == (partner > i)) {
            kept = other;
        }
    }
    sort_key_store(kept);
}
