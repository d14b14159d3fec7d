#version 330 core
// The first pass of a stream reduction: write the flags of four elements to a texel. A flag is 1 if the
// reduction keeps the element, else 0. block_ranks.frag then scans the flags.

#include <records>
#include "core/stream.glsl"

uniform int elements;

#ifdef CHILDREN
// A previous pass wrote elements 4 * i to 4 * i + 3 to texel i of four render targets. The reduction keeps
// elements whose first component is at least 0.
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
