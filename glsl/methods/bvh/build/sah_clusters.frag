#version 330 core
// Assigns each slot to the last cluster that begins at or before the slot. A cluster is a run of slots
// (triangles in Morton order) whose codes share at least MOST_BITS leading bits (gaps.frag).

#include <records>
#include "core/stream.glsl"

void main() {
    int i = element();
    int cluster = int(sums_load(table_texel(i + 1)).value.x) - 1;
    slot_store(Slot(sort_key_load(table_texel(i)).index, cluster, 0));
}
