#version 330 core
// Writes the leaf that begins at a slot, or an empty record if no leaf begins there. A leaf is a span of
// slots (positions in the sorted order of the Morton codes), and its parent is an inner node. Element k of
// the stream `interval` is the inner node of gap k, between the slots k and k + 1 (gaps.frag).

#include <records>
#include "core/stream.glsl"
#include "algorithms/search.glsl"
#include "methods/bvh/build/radix.glsl"

void main() {
    int slot = element();
    int rank = int(sums_load(table_texel(slot)).value.x);
    int after = int(sums_load(table_texel(slot + 1)).value.x);
    if (after == rank) {
        leaf_store(Leaf(-1, -1, -1, 0));
        return;
    }
    int last = find_flagged(after, slot + 1, slots) - 1;
    int parent = parent_gap(slot, last);
    int turns = parent < 0 ? 0 : interval_load(table_texel(parent)).turns + int(parent == last);
    leaf_store(Leaf(slot, last, parent, turns));
}
