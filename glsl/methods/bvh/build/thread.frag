#version 330 core
// Writes a node of the threaded hierarchy: its box, and its escape index, which is the index of the first
// node after its subtree. A subtree with n leaves has 2 * n - 1 nodes.

#include <records>
#include "core/fetch.glsl"
#include "methods/bvh/build/thread.glsl"

uniform int nodes;   // number of nodes of the whole tree

flat in int source;

void main() {
    Interval node = interval_load(table_texel(source));
    Node_box box = node_box_load(table_texel(source));
    int held = int(sums_load(table_texel(node.last + 1)).value.x
                   - sums_load(table_texel(node.first)).value.x);
    int escape = node_place(node) + 2 * held - 1;
    bvh_node_store(Bvh_node(box.lo, escape < nodes ? escape : -1, box.hi,
                            held == 1 ? node.first : -1));
}
