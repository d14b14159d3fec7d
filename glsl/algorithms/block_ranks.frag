#version 330 core
// Scans blocks of BLOCK texels with four elements each (Roger, Assarsson, Holzschuch 2007; survey, section
// 3.6). Each element gets the number of kept elements in its block, up to and including this element.
//
// Departure: Roger et al. count the removed elements before an element, in log2 s passes for a block of s
// elements. Here one pass counts the kept elements.

#include <records>
#include "core/stream.glsl"

void main() {
    int i = element();
    float before = 0.0;
    for (int k = i - i % BLOCK; k < i; ++k) {
        before += dot(flags_load(table_texel(k)).value, vec4(1.0));
    }
    vec4 flag = flags_load(table_texel(i)).value;
    vec2 pair = vec2(flag.x, flag.x + flag.y);
    ranks_store(Ranks(before + vec4(pair, pair.y + flag.z, pair.y + flag.z + flag.w)));
}
