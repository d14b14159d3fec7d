#version 330 core
// The box of each triangle, or with ORDERED of the triangle in each slot of the sorted order.

#include <records>
#include "common/stream.glsl"

void main() {
#ifdef ORDERED
    int i = sort_key_load(table_texel(element())).index;
#else
    int i = element();
#endif
    Triangle triangle = triangle_load(table_texel(i));
    box_store(Box(min(min(triangle.v0, triangle.v1), triangle.v2),
                  max(max(triangle.v0, triangle.v1), triangle.v2)));
}
