#version 330 core
// Writes counts for a scan: x counts the pieces (zhou.glsl) of a large node, and w counts its chunks. y
// counts the pieces of a small node, and z is 1 if y is above 0. Other counts are 0.

#include <records>
#include "core/stream.glsl"

uniform int small;

void main() {
    int count = cell_load(table_texel(element())).count;
    bool large = count > small;
    values_store(Values(vec4(large ? count : 0, large ? 0 : count, !large && count > 0,
                             large ? (count + CHUNK - 1) / CHUNK : 0)));
}
