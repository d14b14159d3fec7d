#version 330 core
// Sends each node to its place in depth-first order.

#include <sources>
#include "core/fetch.glsl"
#include "methods/bvh/build/thread.glsl"
#include "algorithms/point.glsl"

flat out int source;

void main() {
    source = gl_VertexID;
    Interval node = interval_load(table_texel(source));
    place_point(node.first < 0 ? -1 : node_place(node));
}
