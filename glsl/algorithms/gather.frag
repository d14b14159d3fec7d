#version 330 core
// Gather: element i of `source` is an index. Copies the element of this index to element i of the target.
// Works for any record.

#include <records>
#include "core/stream.glsl"

void main() {
    STORE(LOAD(table_texel(source_load(table_texel(element())).index)));
}
