#version 330 core
// Keeps the fragments of the rays in one phase. An occlusion query counts them. In a pass that writes
// depth, their depth marks the rays for the kernel that they wait for. Phase UNFINISHED selects every
// stopped ray, whether the step cap or a full stack stopped it.

#include "core/phase.glsl"
#include <streams>

uniform int phase;

void main() {
    if (max(state_load(ivec2(gl_FragCoord.xy)).phase, UNFINISHED) != phase) {
        discard;
    }
}
