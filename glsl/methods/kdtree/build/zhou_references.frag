#version 330 core
// Writes a reference (a triangle in a leaf's list) of the finished tree. A piece is the part of a triangle
// in a node. The n-th reference of a leaf names the triangle of the leaf's n-th piece. A small leaf marks
// its pieces in a mask. A large leaf has no mask; its pieces are adjacent.

#include <records>
#include "core/stream.glsl"
#include "methods/kdtree/build/zhou.glsl"

uniform int nodes;

FIND_OWNER(leaf_owner, sums_load)

void main() {
    int slot = element();
    int leaf = leaf_owner(slot, 0, 0, nodes);
    int rank = slot - int(sums_load(table_texel(leaf)).value.x);
    Built built = built_load(table_texel(leaf));
    uvec2 mask = mask_bits(built.mask);
    int at = rank;
    if (mask != uvec2(0u)) {
        for (; rank >= 0; --rank) {
            at = take_bit(mask);
        }
    }
    source_store(Source(piece_load(table_texel(built.base + at)).triangle));
}
