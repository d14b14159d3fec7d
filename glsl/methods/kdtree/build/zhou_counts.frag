#version 330 core
// Copies the number of references of each node of the finished tree, for a scan.

#include <records>
#include "core/stream.glsl"

void main() {
    values_store(Values(vec4(built_load(table_texel(element())).count, 0.0, 0.0, 0.0)));
}
