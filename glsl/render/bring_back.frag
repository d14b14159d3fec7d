#version 330 core
// Copy the light that a packed path has found so far to the path's own texel (see bring_back.vert).

#include <streams>

flat in ivec2 source;

void main() {
    radiance_store(radiance_load(source));
}
