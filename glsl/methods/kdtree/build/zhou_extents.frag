#version 330 core
// Writes the extent of every piece (part of a triangle) along every axis. Both ends are candidate planes.

#include <records>
#include "core/stream.glsl"

void main() {
    int i = element();
    Piece piece = piece_load(table_texel(i / 3));
    extent_store(Extent(piece.lo[i % 3], piece.hi[i % 3]));
}
