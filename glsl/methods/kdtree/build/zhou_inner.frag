#version 330 core
// Flags the small nodes that are split.

#include <records>
#include "core/stream.glsl"

void main() {
    values_store(Values(vec4(choice_load(table_texel(element())).inner, 0.0, 0.0, 0.0)));
}
