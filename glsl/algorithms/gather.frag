#version 330 core
// Gather: read an index from element i of the stream `source`, and copy the element with this index to
// element i of the target. The program works for any record.

#include <records>
#include "core/stream.glsl"

void main() {
    STORE(LOAD(table_texel(source_load(table_texel(element())).index)));
}
