#version 330 core
// Write depth at the texels of paths that had ended before the last pass of path_vertex.frag; the early
// depth test then skips these texels. The passes of successive vertices write two sets of textures in
// alternation, and both sets already hold an empty ray at these texels.

#include <streams>

void main() {
    if (walk_load(ivec2(gl_FragCoord.xy)).weight != vec3(0.0)) {
        discard;
    }
}
