#version 330 core
// Writes the slots (positions in the order of the triangles) of the next level. In each node the triangles
// of the left child come first; each child keeps its triangles in their old order. sah_sides.frag flags the
// slots whose triangles go to the right child. A slot finds its triangle by a binary search in the prefix
// sums of these flags. The search stays within the node's slots.

#include <records>
#include "core/stream.glsl"

void main() {
    int i = element();
    Slot slot = slot_load(table_texel(i));
    if (slot.node >= 0) {
        Interval node = interval_load(table_texel(slot.node));
        int taken = split_load(table_texel(slot.node)).taken;
        if (taken == 0) {
            slot.node = -1;
            slot.starts = int(i == node.first);
        } else {
            int wanted = i - node.first;
            bool right = wanted >= taken;
            wanted -= right ? taken : 0;
            int before = int(sums_load(table_texel(node.first)).value.x);
            int lo = node.first, hi = node.last;
            while (lo < hi) {
                int middle = (lo + hi) >> 1;
                int held = int(sums_load(table_texel(middle + 1)).value.x) - before;
                held = right ? held : middle + 1 - node.first - held;
                lo = held > wanted ? lo : middle + 1;
                hi = held > wanted ? middle : hi;
            }
            slot.triangle = slot_load(table_texel(lo)).triangle;
            slot.node = 2 * int(ranks_load(table_texel(slot.node)).value.x) + int(right);
        }
    }
    slot_store(slot);
}
