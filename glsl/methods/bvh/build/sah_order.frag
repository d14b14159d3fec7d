#version 330 core
// Copies the triangle of each slot after the last level, as the final order of the triangles.

#include <records>
#include "core/stream.glsl"

void main() {
    source_store(Source(slot_load(table_texel(element())).triangle));
}
