#version 330 core
// Flags each slot that begins a leaf. A slot is a position in the sorted order of the Morton codes, and gap
// k lies between the slots k and k + 1. gaps.frag keeps a gap as an inner node unless the gap lies inside a
// leaf. Slot 0 and each slot after a kept gap begin a leaf.

#include <records>
#include "core/stream.glsl"

void main() {
    int slot = element();
    bool starts = slot == 0 || interval_load(table_texel(slot - 1)).first >= 0;
    values_store(Values(vec4(float(starts), 0.0, 0.0, 0.0)));
}
