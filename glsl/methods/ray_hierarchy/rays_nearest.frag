#version 330 core
// Updates the rays after a batch of triangles. Blending has found each ray's nearest triangle. To get u and
// v, the ray tests this triangle again.

#include "core/precision.glsl"
#include "core/fetch.glsl"
#include <streams>
#include <tables>
#include "core/stats.glsl"
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/hit.glsl"
#include "core/triangle.glsl"
#include "core/phase.glsl"

uniform int step_cap;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Ray ray = ray_setup(rays_load(pixel));
    State state = state_load(pixel);
    Hit hit = hit_load(pixel);
    CLEAR_COUNTERS;
    int lowest = lowest_load(pixel).triangle;
    int tests = least_load(pixel).tests;
    if (state.phase > DONE) {
        if (lowest < NO_TRIANGLE) {
            test_triangle(ray, lowest, hit);
        }
        state.steps += tests;
        if (search_over(hit)) {
            state.phase = DONE;
        } else if (state.steps >= step_cap) {
            state.steps = step_cap;
            state.phase = UNFINISHED;
        }
    }
    state_store(state_stored(state));
    hit_store(hit_stored(hit));
#ifdef STATISTICS
    Counters before = counters_load(pixel);   // count the batch's tests, but not this pass's own test
    counters_store(Counters(0, before.leaves_visited + tests, before.triangles_tested + tests));
#endif
}
