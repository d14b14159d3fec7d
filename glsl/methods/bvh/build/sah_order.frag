#version 330 core
// Writes the final order of the triangles: after the last level, the order of the slots.

#include <records>
#include "core/stream.glsl"

void main() {
    source_store(Source(slot_load(table_texel(element())).triangle));
}
