#version 330 core
// Appends a list of pieces to the lists that were appended before.

#include <records>
#include "core/stream.glsl"

uniform int offset;

void main() {
    Old_piece old = old_piece_load(table_texel(element() - offset));
    piece_store(Piece(old.lo, old.triangle, old.hi, old.node));
}
