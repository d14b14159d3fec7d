#version 330 core
// Copy the kept elements of a block to the texels that segments.vert covers with one or two lines. A
// fragment's position among these texels is the rank of its element in the block. A binary search in the
// block's ranks finds the element.
//
// Departure: Roger et al. interpolate the position along the line. Here gl_FragCoord gives the position
// without rounding.

#include <records>
#include "core/fetch.glsl"

flat in int block;
flat in int block_start;
flat in int block_total;

uniform int texels;   // number of texels with ranks

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    int place = (texel.y << TABLE_WIDTH_LOG2) + texel.x - block_start;
    float rank = float(place);
    // `place` kept elements of the block precede this element. They come from at least place / 4 texels,
    // because a texel holds four elements. The kept elements after this element bound `hi` in the same way.
    int lo = BLOCK * block + place / 4;
    int hi = min(BLOCK * (block + 1), texels) - 1 - (block_total - 1 - place) / 4;
    while (lo < hi) {
        int middle = (lo + hi) >> 1;
        if (ranks_load(table_texel(middle)).value.w > rank) {
            hi = middle;
        } else {
            lo = middle + 1;
        }
    }
    bvec4 before = lessThanEqual(ranks_load(table_texel(lo)).value, vec4(rank));
    int lane = int(dot(vec4(before), vec4(1.0)));
#ifdef CHILDREN
    Children c = children_load(table_texel(lo));
    ivec3 pair = lane < 2 ? (lane == 0 ? c.first : c.second) : (lane == 2 ? c.third : c.fourth);
    pair_store(Pair(pair.x, pair.y, pair.z));
#else
    STORE(LOAD(table_texel(4 * lo + lane)));
#endif
}
