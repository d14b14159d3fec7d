#version 330 core
// Write the number of kept elements of each block.

#include <records>
#include "core/stream.glsl"

uniform int texels;   // number of texels with ranks

void main() {
    int last = min(BLOCK * (element() + 1), texels) - 1;
    totals_store(Totals(vec4(ranks_load(table_texel(last)).value.w, 0.0, 0.0, 0.0)));
}
