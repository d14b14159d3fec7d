#version 330 core
// Element i is the box around the triangles in a run of slots (positions in the order of the triangles):
// `run` consecutive slots from slot i on. This pass joins the boxes of four consecutive runs to the box of
// a run four times as long. For a run that would begin beyond the last slot, the box of the last slot is
// used. This box changes neither minimum nor maximum.

#include <records>
#include "core/stream.glsl"

uniform int slots;
uniform int run;

void main() {
    int i = element();
    Box box = box_load(table_texel(i));
    for (int k = 1; k < 4; ++k) {
        Box other = box_load(table_texel(min(i + k * run, slots - 1)));
        box = Box(min(box.lo, other.lo), max(box.hi, other.hi));
    }
    box_store(box);
}
