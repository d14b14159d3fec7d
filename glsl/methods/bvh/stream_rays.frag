#version 330 core
// Writes the state, hit and counters of rays that a stream traces (ray_stream.glsl): with START before the
// stream begins, otherwise after the stream has ended. With TALLIED, each ray has a count of its work,
// which shows whether the step cap stopped the ray.

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
#if defined(START)
    Hit hit = no_hit(rays_load(pixel).t_max);
#elif defined(TALLIED)
    Hit hit = hit_load(pixel);
    Tally tally = tally_load(pixel);
    did = ivec3(tally.nodes_visited, tally.leaves_visited, tally.triangles_tested);
    state.steps = min(did.x + did.z, step_cap);
    state.phase = state.steps == step_cap && !search_over(hit) ? UNFINISHED : DONE;
#else
    Hit hit = hit_load(pixel);
#endif
    state_store(state);
    hit_store(hit);
#ifdef STATISTICS
    counters_store(Counters(did.x, did.y, did.z));
#endif
}
