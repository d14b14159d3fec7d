#version 330 core
// Two steps of bitonic merge sort (Batcher 1968), as fragment passes (Purcell et al. 2003; P. Kipfer, R.
// Westermann, "Improved GPU Sorting", GPU Gems 2, 2005). In a step every position compares its element with
// the element of a partner position and keeps the smaller or the larger.
//
// Departures: in the first step of each merge, the partner of a position is its mirror image in the merged
// block. So all steps put the smaller element first; Batcher sorts every second block in descending order.
// Positions past the end count as holding the largest elements and never exchange them. So any number of
// elements can be sorted. A pass runs two steps: each fragment also computes the first step of its second
// partner, so no texture stores the results of the first step.

#include <records>
#include "core/stream.glsl"

uniform int elements;
uniform ivec2 flips;   // for each of the two steps: partner of position i = i ^ flips; 0: no second step

bool before(Sort_key a, Sort_key b) {
    if (a.hi != b.hi) {
        return a.hi < b.hi;
    }
    return a.lo < b.lo || (a.lo == b.lo && a.index < b.index);
}

Sort_key key_at(int i) {
    return sort_key_load(table_texel(min(i, elements - 1)));
}

// The element that position i keeps: its own or its partner's.
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
