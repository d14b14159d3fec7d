#version 330 core
// The extent of every piece along every axis: the planes that small nodes choose from.

#include <records>
#include "core/stream.glsl"

void main() {
    int i = element();
    Piece piece = piece_load(table_texel(i / 3));
    extent_store(Extent(piece.lo[i % 3], piece.hi[i % 3]));
}
