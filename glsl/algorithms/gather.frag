#version 330 core
// Element i becomes the element that source i names; of whatever record.

#include <records>
#include "core/stream.glsl"

void main() {
    STORE(LOAD(table_texel(source_load(table_texel(element())).index)));
}
