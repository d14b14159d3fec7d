#version 330 core
// Writes the input of a scan, four counts per node: a large node's pieces (zhou.glsl); a small node's
// pieces; 1 for a small node with pieces; a large node's chunks of CHUNK pieces. Other counts are 0.

#include <records>
#include "core/stream.glsl"

uniform int small;

void main() {
    int count = cell_load(table_texel(element())).count;
    bool large = count > small;
    values_store(Values(vec4(large ? count : 0, large ? 0 : count, !large && count > 0,
                             large ? (count + CHUNK - 1) / CHUNK : 0)));
}
