#version 330 core
// Adds a triangle to its bin. Blending adds the counts and takes the minimum of all other values. The upper
// corner is negated, so blending finds its maximum.

#include <records>
#include "core/fetch.glsl"

flat in int triangle;

void main() {
    Box box = box_load(table_texel(triangle));
    bin_store(Bin(box.lo, 1, -box.hi));
}
