#version 330 core
// Sends each triangle to its node if the node is binned.

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
