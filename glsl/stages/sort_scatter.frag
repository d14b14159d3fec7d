#version 330 core
// State, hit and counters of a sorted ray, as they are.

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
