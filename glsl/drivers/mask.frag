#version 330 core
// Masks rays that have ended: only their fragments are kept. The fragments write a depth, by which the early
// depth test rejects these rays from now on, and the occlusion query around this pass counts the fragments.
// The pass reads the state before the last kernel pass. A ray that had ended by then has its final state in
// both buffers of the ping-pong. Masked one pass earlier, it would keep an old state in one of the buffers.

#include "core/phase.glsl"
#include <streams>

void main() {
    if (state_load(ivec2(gl_FragCoord.xy)).phase > DONE) {
        discard;
    }
}
