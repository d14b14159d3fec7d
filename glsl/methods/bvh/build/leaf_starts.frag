#version 330 core
// Flags the slots that begin a leaf: the first slot, and each slot after a gap that is a node.

#include <records>
#include "core/stream.glsl"

void main() {
    int slot = element();
    bool starts = slot == 0 || interval_load(table_texel(slot - 1)).first >= 0;
    values_store(Values(vec4(float(starts), 0.0, 0.0, 0.0)));
}
