#version 330 core
// Computes the places of a level's children in the finished tree, in depth-first order with siblings side
// by side. `at` is the place of a child, and `pair` is the place of the child's own two children.

#include <records>
#include "core/stream.glsl"
#include "methods/kdtree/build/zhou.glsl"

uniform int nodes;  // number of nodes in the level above

FIND_OWNER(inner_owner, ranks_load)

void main() {
    int child = element();
    int pair = above_load(table_texel(inner_owner(child >> 1, 0, 0, nodes))).pair;
    int left_size = int(sizes_load(table_texel(child & ~1)).value.x);
    place_store((child & 1) == 0 ? Place(pair, pair + 2) : Place(pair + 1, pair + 1 + left_size));
}
