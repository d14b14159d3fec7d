#version 330 core
// The rays of a stream before it begins (START), and when all is over: what they did, and whether the
// cap on steps stopped them.

#include "core/precision.glsl"
#include "core/fetch.glsl"
#include <streams>
#include "core/hit.glsl"
#include "core/phase.glsl"

uniform int step_cap;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    State state = State(DONE, 0);
    ivec3 did = ivec3(0);
#ifdef START
    Hit hit = no_hit(rays_load(pixel).t_max);
#else
    Hit hit = hit_load(pixel);
#ifdef TALLIED
    Tally tally = tally_load(pixel);
    did = ivec3(tally.nodes_visited, tally.leaves_visited, tally.triangles_tested);
    state.steps = min(did.x + did.z, step_cap);
    state.phase = state.steps == step_cap && !search_over(hit) ? UNFINISHED : DONE;
#endif
#endif
    state_store(state);
    hit_store(hit);
#ifdef STATISTICS
    counters_store(Counters(did.x, did.y, did.z));
#endif
}
