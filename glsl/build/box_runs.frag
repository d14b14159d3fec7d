#version 330 core
// The box of twice as many neighbouring slots: of the run from here and the one `half_run` behind it.

#include <records>
#include "common/stream.glsl"

uniform int slots;
uniform int half_run;

void main() {
    int i = element();
    Box one = box_load(table_texel(i));
    Box two = box_load(table_texel(min(i + half_run, slots - 1)));
    box_store(Box(min(one.lo, two.lo), max(one.hi, two.hi)));
}
