#version 330 core
// Sends each (triangle, node) pair to the node's texel; blending counts the pairs.

#include <sources>
#include "core/fetch.glsl"

uniform int base;
uniform ivec2 size;   // number of nodes of the level, along x and y

void main() {
    Pair pair = pair_load(table_texel(base + gl_VertexID));
    gl_Position = vec4(2.0 * (vec2(pair.x, pair.y) + 0.5) / vec2(size) - 1.0, 0.0, 1.0);
}
