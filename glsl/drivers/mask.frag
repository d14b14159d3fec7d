#version 330 core
// Masks rays that have ended. Only the fragments of these rays survive. They write the depth by which the
// early depth test rejects these rays from now on, and the occlusion query around this pass counts them.
// The pass reads the rays' state as it was before the last kernel pass. A ray that had already ended has
// its final state in both buffers of the ping-pong. If the ray were masked one pass earlier, one buffer
// would keep an old state.

#include "core/phase.glsl"
#include <streams>

void main() {
    if (state_load(ivec2(gl_FragCoord.xy)).phase > DONE) {
        discard;
    }
}
