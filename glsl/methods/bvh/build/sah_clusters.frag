#version 330 core
// The slots of sorted codes, each in the cluster that begins at or before it.

#include <records>
#include "core/stream.glsl"

void main() {
    int i = element();
    int cluster = int(sums_load(table_texel(i + 1)).value.x) - 1;
    slot_store(Slot(sort_key_load(table_texel(i)).index, cluster, 0));
}
