#version 330 core
// Appends a level's small roots to the list of all small roots: copies the places of a root and of its
// children in the finished tree (zhou_places.frag). A small root is a small node whose parent is large.

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
