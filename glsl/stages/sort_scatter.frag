#version 330 core
// Copies a sorted ray's state, hit and counters back (sort_scatter.vert).

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
