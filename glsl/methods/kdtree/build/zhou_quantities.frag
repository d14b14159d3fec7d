#version 330 core
// Writes counts for a scan: x is the number of pieces (zhou.glsl) of a large node, and w of its chunks; y
// is the number of pieces of a small node, and z is 1 if it has any. Other counts are 0.

#include <records>
#include "core/stream.glsl"

uniform int small;

void main() {
    int count = cell_load(table_texel(element())).count;
    bool large = count > small;
    values_store(Values(vec4(large ? count : 0, large ? 0 : count, !large && count > 0,
                             large ? (count + CHUNK - 1) / CHUNK : 0)));
}
