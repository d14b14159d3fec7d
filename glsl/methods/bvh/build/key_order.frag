#version 330 core
// Copies the triangle of each slot from the slot's sort key. A slot is a position in the sorted order.

#include <records>
#include "core/stream.glsl"

void main() {
    source_store(Source(sort_key_load(table_texel(element())).index));
}
