#version 330 core
// Mark the texels of paths that ended before the last vertex. The passes of successive vertices write two
// sets of textures in alternation. At these texels both sets already hold an empty ray, so the early depth
// test may skip these.

#include <streams>

void main() {
    if (walk_load(ivec2(gl_FragCoord.xy)).weight != vec3(0.0)) {
        discard;
    }
}
