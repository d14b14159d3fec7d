#version 330 core
// Writes the final order of the triangles. After the last level the slots are in this order, so copy the
// triangle of each slot.

#include <records>
#include "core/stream.glsl"

void main() {
    source_store(Source(slot_load(table_texel(element())).triangle));
}
