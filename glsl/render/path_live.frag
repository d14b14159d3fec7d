#version 330 core
// Discard ended paths, so that an occlusion query around this pass counts the live paths.

#include <streams>

void main() {
    if (walk_load(ivec2(gl_FragCoord.xy)).weight == vec3(0.0)) {
        discard;
    }
}
