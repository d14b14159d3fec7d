#version 330 core
// Copy a packed path's light back to the texel that the path came from (see bring_back.vert).

#include <streams>

flat in ivec2 source;

void main() {
    radiance_store(radiance_load(source));
}
