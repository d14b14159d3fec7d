#version 330 core
// Masks rays that are over: their fragments alone survive and write the depth that rejects them
// early from now on; the occlusion query around this pass counts them. A ray is masked only when
// its final state stands in both buffers of the ping-pong, else one would keep a stale state.

#include "common/phase.glsl"
#include <streams>

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    if (state_load(pixel).phase > DONE || other_load(pixel).phase > DONE) {
        discard;
    }
}
