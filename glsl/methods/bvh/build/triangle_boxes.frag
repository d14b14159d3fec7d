#version 330 core
// Computes the box of each triangle, multiplied by `unit`. With ORDERED, element i is the box of the i-th
// triangle in the sorted order.

#include <records>
#include "core/stream.glsl"

uniform float unit;   // a power of two, so the products are exact

void main() {
#ifdef ORDERED
    int i = source_load(table_texel(element())).index;
#else
    int i = element();
#endif
    Triangle triangle = triangle_load(table_texel(i));
    box_store(Box(unit * min(min(triangle.v0, triangle.v1), triangle.v2),
                  unit * max(max(triangle.v0, triangle.v1), triangle.v2)));
}
