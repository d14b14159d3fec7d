#version 330 core
// Writes the children of a level's nodes as cells. Cells 2 * k and 2 * k + 1 are children of the level's
// k-th inner node. `futile` counts the consecutive levels whose planes separated no pieces (zhou.glsl).
// With PREFIXES (hybrid build), `futile` is the common prefix of the Morton codes in the node.

#include <records>
#include "core/stream.glsl"
#include "methods/kdtree/build/zhou.glsl"

uniform int cells;

FIND_OWNER(inner_owner, ranks_load)

void main() {
    int child = element();
    int parent = inner_owner(child >> 1, 0, 0, cells), side = child & 1;
    Parent_cell above = parent_cell_load(table_texel(parent));
    Decision decision = decision_load(table_texel(parent));
    int first = int(starts_load(table_texel(parent)).value.x);
    int count = int(sums_load(table_texel(first + above.count)).value[side]
                    - sums_load(table_texel(first)).value[side]);
    int futile = decision.futile;
#ifdef PREFIXES
    futile = 2 * futile + side;
#endif
    Cell cell = Cell(above.lo, count, above.hi, futile, parent);
    if (side == 0) {
        cell.hi[decision.axis] = decision.plane;
    } else {
        cell.lo[decision.axis] = decision.plane;
    }
    cell_store(cell);
}
