#version 330 core
// Flags the large nodes, which are split between bins.

#include <records>
#include "core/stream.glsl"
#include "methods/bvh/build/sah.glsl"
#include "methods/bvh/build/large.glsl"

void main() {
    values_store(Values(vec4(float(is_large(interval_load(table_texel(element())))))));
}
