#version 330 core
// Copies the state, hit and counters of a sorted ray.

#include "core/precision.glsl"
#include <streams>

flat in ivec2 source;

void main() {
    state_store(state_load(source));
    hit_store(hit_load(source));
#ifdef STATISTICS
    counters_store(counters_load(source));
#endif
}
