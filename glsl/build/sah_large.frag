#version 330 core
// Flags the nodes that are binned.

#include <records>
#include "common/stream.glsl"
#include "build/sah.glsl"
#include "build/large.glsl"

void main() {
    values_store(Values(vec4(float(is_large(interval_load(table_texel(element())))))));
}
