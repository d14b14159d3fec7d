#version 330 core
// Flags the slots that begin a leaf. A slot is a position in the order of the triangles.

#include <records>
#include "core/stream.glsl"

void main() {
    values_store(Values(vec4(float(slot_load(table_texel(element())).starts))));
}
