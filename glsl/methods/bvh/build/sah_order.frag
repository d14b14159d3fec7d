#version 330 core
// The triangle of each slot, when no node is left to split.

#include <records>
#include "core/stream.glsl"

void main() {
    source_store(Source(slot_load(table_texel(element())).triangle));
}
