#version 330 core
// Two steps of bitonic merge sort (Batcher 1968; as fragment passes Purcell et al. 2003, and P. Kipfer,
// R. Westermann, "Improved GPU Sorting", GPU Gems 2, 2005). In a step every element looks at one
// partner and keeps the smaller of the two, or the larger one.
//
// Departures: the first step of each merge mirrors a block instead of shifting it, so that all steps
// put the smaller one first. Elements past the end count as the largest ones and stay where they
// are, so that any number can be sorted. A pass takes two steps, as a fragment can gather all four
// elements that decide them: the first step is then done twice, but half as many are stored.

#include <records>
#include "core/stream.glsl"

uniform int elements;
uniform ivec2 flips;   // bits in which the partner's place differs, step by step; 0: no second step

bool before(Sort_key a, Sort_key b) {
    if (a.hi != b.hi) {
        return a.hi < b.hi;
    }
    return a.lo < b.lo || (a.lo == b.lo && a.index < b.index);
}

Sort_key key_at(int i) {
    return sort_key_load(table_texel(min(i, elements - 1)));
}

// What place i keeps of its own element and its partner's.
Sort_key kept(int i, Sort_key own, int partner, Sort_key other) {
    if (partner < elements && before(other, own) == (partner > i)) {
        return other;
    }
    return own;
}

Sort_key after_first(int i) {
    int partner = i ^ flips.x;
    return kept(i, key_at(i), partner, key_at(partner));
}

void main() {
    int i = element();
    Sort_key key = after_first(i);
    if (flips.y != 0) {
        int partner = i ^ flips.y;
        key = kept(i, key, partner, after_first(partner));
    }
    sort_key_store(key);
}
