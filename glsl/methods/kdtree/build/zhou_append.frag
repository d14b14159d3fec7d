#version 330 core
// Appends a list of pieces (zhou.glsl) to the `offset` pieces of earlier lists.

#include <records>
#include "core/stream.glsl"

uniform int offset;

void main() {
    Old_piece old = old_piece_load(table_texel(element() - offset));
    piece_store(Piece(old.lo, old.triangle, old.hi, old.node));
}
