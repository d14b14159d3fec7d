#version 330 core
// The rays take up what blending left them: START begins, FINISH ends them all; else a ray tests the
// triangle once more that was nearest, for u and v.

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
uniform ivec2 fan;   // rays below a node of the first level

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Ray ray = ray_setup(rays_load(pixel));
#ifdef START
    Hit hit = no_hit(ray.t_max);
    State state = State(ray.t_min <= ray.t_max ? INTERSECT : DONE, 0);
#ifdef STATISTICS
    counters = Counters(0, 0, 0);
#endif
#else
    State state = state_load(pixel);
    Hit hit = hit_load(pixel);
#ifdef STATISTICS
    counters = counters_load(pixel);
#endif
#ifdef FINISH
    state.phase = min(state.phase, DONE);
#ifdef STATISTICS
    counters.nodes_visited = visits_load(pixel / fan).count;
#endif
#else
    int lowest = lowest_load(pixel).triangle;
    int tests = least_load(pixel).tests;
#ifdef STATISTICS
    Counters before = counters;
#endif
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
#ifdef STATISTICS
    counters = Counters(0, before.leaves_visited + tests, before.triangles_tested + tests);
#endif
#endif
#endif
    state_store(state_stored(state));
    hit_store(hit_stored(hit));
#ifdef STATISTICS
    counters_store(counters);
#endif
}
