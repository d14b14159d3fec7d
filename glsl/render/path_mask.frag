#version 330 core
// Marks the texels of paths that had ended before the last vertex: in both of the textures that
// vertices take turns to write there is nothing of them, and early depth may leave them out.

#include <streams>

void main() {
    if (walk_load(ivec2(gl_FragCoord.xy)).weight != vec3(0.0)) {
        discard;
    }
}
