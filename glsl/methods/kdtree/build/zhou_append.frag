#version 330 core
// Puts one list of pieces behind others.

#include <records>
#include "core/stream.glsl"

uniform int offset;

void main() {
    Old_piece old = old_piece_load(table_texel(element() - offset));
    piece_store(Piece(old.lo, old.triangle, old.hi, old.node));
}
