#version 330 core
// Writes the hit and the state of each ray. To get u and v, each ray tests its triangle once more.

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

uniform int steps;         // number of batches of triangles that were drawn
uniform bool cut_short;    // whether the step cap stopped the search before the last batch

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Ray ray = ray_setup(rays_load(pixel));
    bool live = ray.t_min <= ray.t_max;
    Hit hit = no_hit(ray.t_max);
#ifdef STATISTICS
    counters = Counters(0, 0, 0);
#endif
    int triangle = found_load(pixel).triangle;
    if (triangle != NO_TRIANGLE) {
        test_triangle(ray, triangle, hit);
    }
    hit_store(hit);
    State state = State(DONE, live ? steps : 0);
    if (live && cut_short && !search_over(hit)) {
        state.phase = UNFINISHED;
    }
    state_store(state);
#ifdef STATISTICS
    Quads quads = quads_load(pixel);
    counters_store(Counters(quads.drawn, 0, quads.tested));
#endif
}
