#version 330 core
// Lets through the rays in one phase: an occlusion query counts them, and in a pass that writes
// depth they are marked for the kernel they wait for.

#include <streams>

uniform int phase;

void main() {
    if (state_load(ivec2(gl_FragCoord.xy)).phase != phase) {
        discard;
    }
}
