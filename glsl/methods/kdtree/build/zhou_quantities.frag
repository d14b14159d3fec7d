#version 330 core
// The counts that each node of a level contributes: pieces of large nodes, pieces of small nodes, small
// nodes that are not empty, chunks of large nodes.

#include <records>
#include "core/stream.glsl"

uniform int small;

void main() {
    int count = cell_load(table_texel(element())).count;
    bool large = count > small;
    values_store(Values(vec4(large ? count : 0, large ? 0 : count, !large && count > 0,
                             large ? (count + CHUNK - 1) / CHUNK : 0)));
}
