#version 330 core
// The triangle of each slot, without its key.

#include <records>
#include "core/stream.glsl"

void main() {
    source_store(Source(sort_key_load(table_texel(element())).index));
}
