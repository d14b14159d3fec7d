#version 330 core
// Bounds the box centres of a node's triangles. The upper corner is negated, so that the minimum serves as
// blend equation for both corners.

#include <records>
#include "core/fetch.glsl"
#include "methods/bvh/build/middle.glsl"

flat in int triangle;

void main() {
    vec3 middle = middle_of(box_load(table_texel(triangle)));
    range_store(Range(middle, -middle));
}
