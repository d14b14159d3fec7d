#version 330 core
// Writes the final state of the rays, after the last batch of triangles. A ray that the step cap did not
// stop is done. A ray's counter of visited nodes is the number of visits to the ray's node in the level
// above the rays. This number includes the visits to the node's ancestors (visits_below.frag).

#include "core/precision.glsl"
#include "core/fetch.glsl"
#include <streams>
#include "core/stats.glsl"
#include "core/phase.glsl"

uniform ivec2 fan;   // a node of the level above the rays holds fan.x * fan.y rays

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    State state = state_load(pixel);
    state.phase = min(state.phase, DONE);
    state_store(state_stored(state));
    hit_store(hit_stored(hit_load(pixel)));
#ifdef STATISTICS
    LOAD_COUNTERS(pixel);
    counters.nodes_visited = visits_load(pixel / fan).count;
    STORE_COUNTERS;
#endif
}
