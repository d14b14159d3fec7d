#version 330 core
// For each node, counts the ancestors that have this node in their left subtree, by pointer jumping (J. C.
// Wyllie, "The Complexity of Parallel Computations", 1979): each pass doubles the distance between a node
// and the ancestor to which the node refers.

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
