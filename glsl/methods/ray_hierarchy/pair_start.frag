#version 330 core
// Writes the first pairs of a stream: each triangle of a batch with each node of the topmost level.

#include <records>
#include "core/stream.glsl"

uniform int first_triangle;
uniform ivec2 nodes;

void main() {
    int i = element(), count = nodes.x * nodes.y;
    int node = i % count;
    pair_store(Pair(first_triangle + i / count, node % nodes.x, node / nodes.x));
}
