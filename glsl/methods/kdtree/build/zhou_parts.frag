#version 330 core
// Writes the pieces (zhou.glsl) of a level's children: of large children if CHANNEL is 0, else of small
// children. Binary searches find the child of each new piece, and the parent's piece that contains it.

#include <records>
#include "core/stream.glsl"
#include "methods/kdtree/build/zhou_half.glsl"

uniform int cells;
uniform int first_root;     // number of small roots in all earlier levels

FIND_OWNER(cell_owner, next_starts_load)
FIND_OWNER(find_part, sums_load)

void main() {
    int slot = element();
    int child = cell_owner(slot, CHANNEL, 0, cells), side = child & 1;
    vec4 before = next_starts_load(table_texel(child)).value;
    int parent = cell_load(table_texel(child)).parent;
    int first = int(starts_load(table_texel(parent)).value.x);
    int end = int(starts_load(table_texel(parent + 1)).value.x);
    int rank = slot - int(before[CHANNEL]) + int(sums_load(table_texel(first)).value[side]);
    Old_piece old = old_piece_load(table_texel(find_part(rank, side, first, end)));
    Decision decision = decision_load(table_texel(parent));
    Piece piece = Piece(old.lo, old.triangle, old.hi, old.node);
    take_half(piece, decision.axis, decision.plane, side);
    piece.node = CHANNEL == 0 ? child : first_root + int(before.z);
    piece_store(piece);
}
