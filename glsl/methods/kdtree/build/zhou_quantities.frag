#version 330 core
// Writes the input of a scan, four counts per node of a level: the pieces of a large node; the pieces of a
// small node; 1 for a small node that is not empty; the chunks of a large node.

#include <records>
#include "core/stream.glsl"

uniform int small;

void main() {
    int count = cell_load(table_texel(element())).count;
    bool large = count > small;
    values_store(Values(vec4(large ? count : 0, large ? 0 : count, !large && count > 0,
                             large ? (count + CHUNK - 1) / CHUNK : 0)));
}
