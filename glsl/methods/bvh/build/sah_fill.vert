#version 330 core
// Sends each triangle of a large node to its bin on each of the three axes.

#include <sources>
#include "core/fetch.glsl"
#include "algorithms/point.glsl"

flat out int triangle;

void main() {
    int i = gl_VertexID / 3, axis = gl_VertexID - 3 * i;
    triangle = slot_load(table_texel(i)).triangle;
    vec4 bins = values_load(table_texel(i)).value;
    place_point(bins.w < 0.0 ? -1 : (int(bins.w) * 3 + axis) * BINS + int(bins[axis]));
}
