#version 330 core
// Flags a level's split nodes. A second channel counts the pieces (zhou.glsl) of each unsplit large node.

#include <records>
#include "core/stream.glsl"

uniform int small;

void main() {
    int i = element();
    int count = cell_load(table_texel(i)).count;
    bool inner = decision_load(table_texel(i)).axis < 3;
    values_store(Values(vec4(inner, !inner && count > small ? count : 0, 0.0, 0.0)));
}
