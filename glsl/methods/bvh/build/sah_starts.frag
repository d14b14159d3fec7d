#version 330 core
// Flags the slots (positions in the order of the triangles) that begin a leaf.

#include <records>
#include "core/stream.glsl"

void main() {
    values_store(Values(vec4(float(slot_load(table_texel(element())).starts))));
}
