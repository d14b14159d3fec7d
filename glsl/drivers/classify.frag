#version 330 core
// Lets through the rays in one phase. An occlusion query counts these rays. In a pass that writes depth,
// the depth marks these rays for the kernel that they wait for. Phase UNFINISHED stands for every stopped
// ray, whatever stopped it.

#include "core/phase.glsl"
#include <streams>

uniform int phase;

void main() {
    if (max(state_load(ivec2(gl_FragCoord.xy)).phase, UNFINISHED) != phase) {
        discard;
    }
}
