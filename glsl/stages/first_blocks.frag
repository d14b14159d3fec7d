#version 330 core
// Finds three numbers for each square of pixels: the greatest depth that the rasteriser shows, and the
// lowest and the highest index of the shown triangles.

#include "core/precision.glsl"
#include <streams>

void main() {
    ivec2 corner = ivec2(gl_FragCoord.xy) * ivec2(BLOCK / 4, BLOCK);
    ivec2 last = textureSize(shown_four_texel_0, 0) - 1;
    vec4 depth = vec4(-1.0);
    ivec4 lowest = ivec4(1 << 24);
    ivec4 highest = ivec4(0);
    for (int k = 0; k < BLOCK * BLOCK / 4; ++k) {
        ivec2 four = corner + ivec2(k % (BLOCK / 4), k / (BLOCK / 4));
        Shown_four shown = shown_four_load(min(four, last));
        depth = max(depth, shown.depth);
        lowest = min(lowest, shown.triangle);
        highest = max(highest, shown.triangle);
    }
    shown_block_store(Shown_block(
        max(max(depth.x, depth.y), max(depth.z, depth.w)),
        min(min(lowest.x, lowest.y), min(lowest.z, lowest.w)),
        max(max(highest.x, highest.y), max(highest.z, highest.w))));
}
