#version 330 core
// Flags each slot that begins a leaf. A slot is a position in the sorted order of the Morton codes, and gap
// k lies between the slots k and k + 1. Slot 0 begins a leaf, and so does each slot after a gap that is an
// inner node (gaps.frag).

#include <records>
#include "core/stream.glsl"

void main() {
    int slot = element();
    bool starts = slot == 0 || interval_load(table_texel(slot - 1)).first >= 0;
    values_store(Values(vec4(float(starts), 0.0, 0.0, 0.0)));
}
