#version 330 core
// Copies the final positions of a level's small roots (small nodes whose parents are large) to the list of
// all small roots' positions.

#include <records>
#include "core/stream.glsl"
#include "methods/kdtree/build/zhou.glsl"

uniform int cells;
uniform int first_root;

FIND_OWNER(root_owner, starts_load)

void main() {
    Above above = above_load(table_texel(root_owner(element() - first_root, 2, 0, cells)));
    place_store(Place(above.at, above.pair));
}
