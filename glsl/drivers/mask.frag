#version 330 core
// Masks rays that have ended: keeps only their fragments. By their depth, the early depth test rejects
// these rays in later passes. The occlusion query around this pass counts the fragments. A pass over rays
// reads the states from before the last kernel pass, which copied ended rays unchanged. So both ping-pong
// buffers hold the final state of each masked ray. A pass over packets only counts ended packets.

#include "core/phase.glsl"
#include <streams>

void main() {
    if (state_load(ivec2(gl_FragCoord.xy)).phase > DONE) {
        discard;
    }
}
