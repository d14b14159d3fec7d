#version 330 core
// Writes the extent of every piece along every axis. The two ends are candidate planes of small nodes.

#include <records>
#include "core/stream.glsl"

void main() {
    int i = element();
    Piece piece = piece_load(table_texel(i / 3));
    extent_store(Extent(piece.lo[i % 3], piece.hi[i % 3]));
}
