#version 330 core
// Masks rays that are over: their fragments alone survive and write the depth that rejects them
// early from now on; the occlusion query around this pass counts them. The state read is the one
// before the last pass: a ray that was over then has its final state in both buffers of the
// ping-pong. Masked sooner, one buffer would keep a stale state.

#include "core/phase.glsl"
#include <streams>

void main() {
    if (state_load(ivec2(gl_FragCoord.xy)).phase > DONE) {
        discard;
    }
}
