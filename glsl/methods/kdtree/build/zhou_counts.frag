#version 330 core
// The number of references of each node of the finished tree.

#include <records>
#include "core/stream.glsl"

void main() {
    values_store(Values(vec4(built_load(table_texel(element())).count, 0.0, 0.0, 0.0)));
}
