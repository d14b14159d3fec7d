#version 330 core
// Of a level's nodes: those that are split, and the pieces of large ones that are not.

#include <records>
#include "core/stream.glsl"

uniform int small;

void main() {
    int i = element();
    int count = cell_load(table_texel(i)).count;
    bool inner = decision_load(table_texel(i)).axis < 3;
    values_store(Values(vec4(inner, !inner && count > small ? count : 0, 0.0, 0.0)));
}
