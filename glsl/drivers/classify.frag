#version 330 core
// Lets through the rays in one phase: an occlusion query counts them, and in a pass that writes
// depth they are marked for the kernel they wait for. Phase UNFINISHED stands for every ray that was
// stopped, whatever by.

#include "core/phase.glsl"
#include <streams>

uniform int phase;

void main() {
    if (max(state_load(ivec2(gl_FragCoord.xy)).phase, UNFINISHED) != phase) {
        discard;
    }
}
