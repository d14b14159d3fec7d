#version 330 core
// Writes the children of small nodes: each child's box, and the mask of its pieces (zhou.glsl).

#include <records>
#include "core/stream.glsl"
#include "methods/kdtree/build/zhou.glsl"

uniform int nodes;

FIND_OWNER(inner_owner, ranks_load)

void main() {
    int child = element();
    int parent = inner_owner(child >> 1, 0, 0, nodes), side = child & 1;
    Old_node above = old_node_load(table_texel(parent));
    Choice choice = choice_load(table_texel(parent));
    Sides sides = sides_load(table_texel(choice.source));
    bool lower = choice.face < 3;
    vec4 left = lower ? sides.lower_left : sides.upper_left;
    vec4 right = lower ? sides.lower_right : sides.upper_right;
    Node node = Node(above.lo, above.base, above.hi, above.levels - 1,
                     mask_floats(mask_bits(above.mask)
                                 & mask_bits(side == 0 ? left : right)));
    if (side == 0) {
        node.hi[choice.face % 3] = choice.plane;
    } else {
        node.lo[choice.face % 3] = choice.plane;
    }
    node_store(node);
}
