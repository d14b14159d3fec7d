#version 330 core
// Where a stream of pairs begins: some triangles with every node of the topmost level in use.

#include <records>
#include "core/stream.glsl"

uniform int first_triangle;
uniform ivec2 nodes;

void main() {
    int i = element(), count = nodes.x * nodes.y;
    int node = i % count;
    pair_store(Pair(first_triangle + i / count, node % nodes.x, node / nodes.x));
}
