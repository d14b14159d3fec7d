#version 330 core
// What a packed path has found so far, as it is.

#include <streams>

flat in ivec2 source;

void main() {
    radiance_store(radiance_load(source));
}
