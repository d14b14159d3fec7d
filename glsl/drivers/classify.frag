#version 330 core
// Keeps the fragments of the rays in one phase, so that an occlusion query counts these rays. If the pass
// also writes depth, the next passes draw only these rays, by a depth test for equality. Phase UNFINISHED
// also selects rays in phase OVERFLOWN.

#include "core/phase.glsl"
#include <streams>

uniform int phase;

void main() {
    if (max(state_load(ivec2(gl_FragCoord.xy)).phase, UNFINISHED) != phase) {
        discard;
    }
}
