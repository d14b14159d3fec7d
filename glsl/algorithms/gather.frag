#version 330 core
// Gather: copy to element i the element that source i names. Works for any record.

#include <records>
#include "core/stream.glsl"

void main() {
    STORE(LOAD(table_texel(source_load(table_texel(element())).index)));
}
