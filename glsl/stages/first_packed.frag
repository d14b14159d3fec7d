#version 330 core
// Packs the triangles and depths of four pixels of a row into one texel, because reads dominate the search
// in stages/first_rivals.frag.

#include "core/precision.glsl"
#include <streams>

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy) * ivec2(4, 1);
    ivec2 last = textureSize(shown_texel_0, 0) - 1;
    Shown a = shown_load(pixel);
    Shown b = shown_load(min(pixel + ivec2(1, 0), last));
    Shown c = shown_load(min(pixel + ivec2(2, 0), last));
    Shown d = shown_load(min(pixel + ivec2(3, 0), last));
    shown_four_store(Shown_four(ivec4(a.triangle, b.triangle, c.triangle, d.triangle),
                                vec4(a.depth, b.depth, c.depth, d.depth)));
}
