#version 330 core
// Flags each slot that begins a leaf: slot 0, and each slot after a gap that gaps.frag kept. A slot is a
// position in the sorted order of the Morton codes, and gap k lies between the slots k and k + 1.

#include <records>
#include "core/stream.glsl"

void main() {
    int slot = element();
    bool starts = slot == 0 || interval_load(table_texel(slot - 1)).first >= 0;
    values_store(Values(vec4(float(starts), 0.0, 0.0, 0.0)));
}
