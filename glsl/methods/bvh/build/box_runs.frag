#version 330 core
// The box of four times as many neighbouring slots: of four runs that follow one another. Where the
// slots end the last ones are taken again, which changes no minimum and no maximum.

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
