#version 330 core
// A fragment for each path that goes on, for an occlusion query to count.

#include <streams>

out vec4 live;

void main() {
    if (walk_load(ivec2(gl_FragCoord.xy)).weight == vec3(0.0)) {
        discard;
    }
    live = vec4(1.0);
}
