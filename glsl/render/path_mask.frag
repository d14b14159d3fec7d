#version 330 core
// Mark the texels of paths that ended before the last vertex. Both textures that vertices write in
// alternation are empty there, so early depth may skip these texels.

#include <streams>

void main() {
    if (walk_load(ivec2(gl_FragCoord.xy)).weight != vec3(0.0)) {
        discard;
    }
}
