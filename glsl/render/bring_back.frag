#version 330 core
// Copy the light that a packed path has found so far.

#include <streams>

flat in ivec2 source;

void main() {
    radiance_store(radiance_load(source));
}
