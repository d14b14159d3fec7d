#version 330 core
// Copies the triangle of each slot (position in the sorted order) from the slot's sort key.

#include <records>
#include "core/stream.glsl"

void main() {
    source_store(Source(sort_key_load(table_texel(element())).index));
}
