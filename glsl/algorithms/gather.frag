#version 330 core
// Gather: element i of the target becomes a copy of the element whose index is source i. The program works
// for any record.

#include <records>
#include "core/stream.glsl"

void main() {
    STORE(LOAD(table_texel(source_load(table_texel(element())).index)));
}
