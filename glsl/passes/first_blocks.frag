#version 330 core
// Squares of pixels: the greatest depth shown there, and the lowest and highest triangle.

#include "common/precision.glsl"
#include <streams>

void main() {
    ivec2 corner = ivec2(gl_FragCoord.xy) * BLOCK;
    ivec2 last = textureSize(shown_texel_0, 0) - 1;
    Shown_block block = Shown_block(-1.0, 1 << 24, 0);
    for (int k = 0; k < BLOCK * BLOCK; ++k) {
        Shown shown = shown_load(min(corner + ivec2(k % BLOCK, k / BLOCK), last));
        block.depth = max(block.depth, shown.depth);
        block.lowest = min(block.lowest, shown.triangle);
        block.highest = max(block.highest, shown.triangle);
    }
    shown_block_store(block);
}
