#version 330 core
// Appends a level's small roots (small nodes whose parents are large) to the list for all levels.

#include <records>
#include "core/stream.glsl"
#include "methods/kdtree/build/zhou.glsl"

uniform int cells;
uniform int first_root;
uniform int first_piece;
uniform int levels;     // largest number of levels below a small root

FIND_OWNER(root_owner, starts_load)

void main() {
    int owner = root_owner(element() - first_root, 2, 0, cells);
    Cell cell = cell_load(table_texel(owner));
    int base = first_piece + int(starts_load(table_texel(owner)).value.y);
    // Set the lowest bits, one bit for each piece. A shift by 32 would be undefined.
    ivec2 bits = clamp(cell.count - ivec2(0, 32), 0, 32);
    uvec2 mask = uvec2(bits.x > 0 ? ~0u >> (32 - bits.x) : 0u, bits.y > 0 ? ~0u >> (32 - bits.y) : 0u);
    node_store(Node(cell.lo, base, cell.hi, levels, mask_floats(mask)));
}
