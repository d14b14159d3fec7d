#version 330 core
// Masks rays that have ended. Only the fragments of these rays survive. They write the depth that rejects
// the rays early from now on, and the occlusion query around this pass counts them. The pass reads the
// state from before the last pass: a ray that had ended then has its final state in both buffers of the
// ping-pong. An earlier mask would leave a stale state in one buffer.

#include "core/phase.glsl"
#include <streams>

void main() {
    if (state_load(ivec2(gl_FragCoord.xy)).phase > DONE) {
        discard;
    }
}
