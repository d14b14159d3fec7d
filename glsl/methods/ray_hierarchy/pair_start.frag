#version 330 core
// Writes a stream's first pairs: each triangle of a batch with each node of the ray hierarchy's top level.

#include <records>
#include "core/stream.glsl"

uniform int first_triangle;
uniform ivec2 nodes;

void main() {
    int i = element(), count = nodes.x * nodes.y;
    int node = i % count;
    pair_store(Pair(first_triangle + i / count, node % nodes.x, node / nodes.x));
}
