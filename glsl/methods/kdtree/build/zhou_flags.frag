#version 330 core
// Flags the split nodes of a level. A second channel holds the number of pieces of each unsplit large node.

#include <records>
#include "core/stream.glsl"

uniform int small;

void main() {
    int i = element();
    int count = cell_load(table_texel(i)).count;
    bool inner = decision_load(table_texel(i)).axis < 3;
    values_store(Values(vec4(inner, !inner && count > small ? count : 0, 0.0, 0.0)));
}
