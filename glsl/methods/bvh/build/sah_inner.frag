#version 330 core
// Flags the nodes of the level that are split.

#include <records>
#include "core/stream.glsl"

void main() {
    values_store(Values(vec4(float(split_load(table_texel(element())).taken > 0))));
}
