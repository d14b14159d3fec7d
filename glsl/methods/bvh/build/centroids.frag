#version 330 core
// Writes the centre of each box.

#include <records>
#include "core/stream.glsl"
#include "methods/bvh/build/middle.glsl"

void main() {
    values_store(Values(vec4(middle_of(box_load(table_texel(element()))), 0.0)));
}
