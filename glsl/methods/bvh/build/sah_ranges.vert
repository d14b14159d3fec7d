#version 330 core
// Places a point for each triangle of a large node (large.glsl) on the node's texel.

#include <sources>
#include "core/fetch.glsl"
#include "methods/bvh/build/sah.glsl"
#include "methods/bvh/build/large.glsl"
#include "algorithms/point.glsl"

flat out int triangle;

void main() {
    Slot slot = slot_load(table_texel(gl_VertexID));
    triangle = slot.triangle;
    int node = max(slot.node, 0);
    bool binned = slot.node >= 0 && is_large(interval_load(table_texel(node)));
    place_point(binned ? int(large_load(table_texel(node)).value.x) : -1);
}
