#version 330 core
// Flags each piece (zhou.glsl) twice: if a part lies left of the node's plane, and if a part lies right.

#include <records>
#include "core/stream.glsl"
#include "methods/kdtree/build/zhou_half.glsl"

void main() {
    Piece piece = piece_load(table_texel(element()));
    Decision decision = decision_load(table_texel(piece.node));
    vec4 sides = vec4(0.0);
    for (int side = 0; side < 2; ++side) {
        Piece part = piece;
        sides[side] = float(decision.axis < 3
                            && take_half(part, decision.axis, decision.plane, side));
    }
    values_store(Values(sides));
}
