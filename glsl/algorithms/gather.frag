#version 330 core
// Gather: element i of the target becomes a copy of the input's element at index `source`[i]. The macros
// LOAD and STORE read and write an element.

#include <records>
#include "core/stream.glsl"

void main() {
    STORE(LOAD(table_texel(source_load(table_texel(element())).index)));
}
