#version 330 core
// Write the flags of four elements to a texel: texel i says which of the elements 4 i ... 4 i + 3 are kept.
// A scan of blocks follows.

#include <records>
#include "core/stream.glsl"

uniform int elements;

#ifdef CHILDREN
// A previous pass wrote the four elements to four targets.
vec4 flags(int i) {
    Children c = children_load(table_texel(i));
    return vec4(greaterThanEqual(ivec4(c.first.x, c.second.x, c.third.x, c.fourth.x), ivec4(0)));
}
#else
float flag(int i) {
    return i < elements ? kept_load(table_texel(min(i, elements - 1))).value.x : 0.0;
}

vec4 flags(int i) {
    return vec4(flag(4 * i), flag(4 * i + 1), flag(4 * i + 2), flag(4 * i + 3));
}
#endif

void main() {
    flags_store(Flags(flags(element())));
}
