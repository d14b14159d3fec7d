#version 330 core
// Mark the texels of paths that had already ended before the last pass of path_vertex.frag. The passes of
// successive vertices write two sets of textures in alternation. Both sets already hold an empty ray at
// these texels, so the early depth test may skip the texels.

#include <streams>

void main() {
    if (walk_load(ivec2(gl_FragCoord.xy)).weight != vec3(0.0)) {
        discard;
    }
}
