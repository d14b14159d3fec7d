#version 330 core
// Writes the final order: the triangle in each slot (position) after the last level.

#include <records>
#include "core/stream.glsl"

void main() {
    source_store(Source(slot_load(table_texel(element())).triangle));
}
