#version 330 core
// Copies the pieces (parts of triangles) of large nodes that became leaves: no plane separated the pieces,
// or the tree had reached a limit.

#include <records>
#include "core/stream.glsl"
#include "methods/kdtree/build/zhou.glsl"

uniform int cells;

FIND_OWNER(stuck_owner, ranks_load)

void main() {
    int slot = element();
    int owner = stuck_owner(slot, 1, 0, cells);
    int rank = slot - int(ranks_load(table_texel(owner)).value.y);
    Old_piece old = old_piece_load(table_texel(int(starts_load(table_texel(owner)).value.x) + rank));
    piece_store(Piece(old.lo, old.triangle, old.hi, owner));
}
