#version 330 core
// Sends each triangle to its node, if that is binned.

#include <sources>
#include "common/fetch.glsl"
#include "build/sah.glsl"
#include "build/large.glsl"
#include "build/point.glsl"

flat out int triangle;

void main() {
    Slot slot = slot_load(table_texel(gl_VertexID));
    triangle = slot.triangle;
    int node = max(slot.node, 0);
    bool binned = slot.node >= 0 && is_large(interval_load(table_texel(node)));
    place_point(binned ? int(large_load(table_texel(node)).value.x) : -1);
}
