#version 330 core
// The paths that go on: an occlusion query around this pass tells how many they are.

#include <streams>

void main() {
    if (walk_load(ivec2(gl_FragCoord.xy)).weight == vec3(0.0)) {
        discard;
    }
}
