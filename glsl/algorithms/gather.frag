#version 330 core
// Gather: element i of the target gets the element whose index is element i of the stream `source`. The
// program works for any record.

#include <records>
#include "core/stream.glsl"

void main() {
    STORE(LOAD(table_texel(source_load(table_texel(element())).index)));
}
