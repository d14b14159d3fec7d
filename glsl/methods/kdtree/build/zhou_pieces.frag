#version 330 core
// Writes the pieces of the root: each piece is a whole triangle with a padded box.

#include <records>
#include "core/stream.glsl"

uniform float pad;

void main() {
    int i = element();
    Triangle triangle = triangle_load(table_texel(i));
    piece_store(Piece(min(min(triangle.v0, triangle.v1), triangle.v2) - pad, i,
                      max(max(triangle.v0, triangle.v1), triangle.v2) + pad, 0));
}
