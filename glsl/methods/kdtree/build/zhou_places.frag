#version 330 core
// Where the children of a level stand in depth-first order, siblings side by side: `at`; and where
// the pair of their own children goes: `pair`.

#include <records>
#include "core/stream.glsl"
#include "methods/kdtree/build/zhou.glsl"

uniform int nodes;  // of the level above

FIND_OWNER(inner_owner, ranks_load)

void main() {
    int child = element();
    int pair = above_load(table_texel(inner_owner(child >> 1, 0, 0, nodes))).pair;
    int left_size = int(sizes_load(table_texel(child & ~1)).value.x);
    place_store((child & 1) == 0 ? Place(pair, pair + 2) : Place(pair + 1, pair + 1 + left_size));
}
