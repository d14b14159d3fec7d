#version 330 core
// Masks rays that have ended: the pass keeps only the fragments of these rays. From now on the early depth
// test rejects these rays, because the fragments have written a depth. The occlusion query around this pass
// counts the fragments. A pass over rays reads the states from before the last kernel pass. A ray that had
// ended by then has its final state in both ping-pong buffers. A ray that ended in the last kernel pass has
// an old state in one buffer, so it is masked later. A pass over packets only counts ended packets.

#include "core/phase.glsl"
#include <streams>

void main() {
    if (state_load(ivec2(gl_FragCoord.xy)).phase > DONE) {
        discard;
    }
}
