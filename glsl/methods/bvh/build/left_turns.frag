#version 330 core
// Counts, for every node, its ancestors that have it in their left subtree, by pointer jumping (J. C.
// Wyllie, "The Complexity of Parallel Computations", 1979): what lies between a node and the ancestor
// it knows doubles with each pass.

#include <records>
#include "core/stream.glsl"

void main() {
    Interval node = interval_load(table_texel(element()));
    if (node.first >= 0 && node.parent >= 0) {
        Interval above = interval_load(table_texel(node.parent));
        node.turns += above.turns;
        node.parent = above.parent;
    }
    interval_store(node);
}
