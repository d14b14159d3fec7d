#version 330 core
// Sorts each leaf's triangles by index. A leaf is a run of slots (positions in the order of the triangles).
// A triangle goes to slot k of its leaf if k triangles of the leaf have a lower index.

#include <records>
#include "core/stream.glsl"
#include "algorithms/search.glsl"

uniform int slots;
uniform int max_leaf;

void main() {
    int slot = element();
    int leaf = int(sums_load(table_texel(slot + 1)).value.x) - 1;
    int first = find_flagged(leaf, max(0, slot + 1 - max_leaf), slot + 1);
    int end = find_flagged(leaf + 1, slot + 1, min(slots, slot + max_leaf));
    int found = -1;
    for (int i = first; i < end; ++i) {
        int index = source_load(table_texel(i)).index;
        int before = 0;
        for (int k = first; k < end; ++k) {
            before += int(source_load(table_texel(k)).index < index);
        }
        found = before == slot - first ? index : found;
    }
    source_store(Source(found));
}
