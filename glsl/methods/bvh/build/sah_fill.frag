#version 330 core
// A triangle in a bin: blending adds up the count and takes the minimum of all else.

#include <records>
#include "core/fetch.glsl"

flat in int triangle;

void main() {
    Box box = box_load(table_texel(triangle));
    bin_store(Bin(box.lo, 1, -box.hi));
}
