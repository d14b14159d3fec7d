#version 330 core
// The driver of every method: runs the method's kernels on each ray's state, up to `steps_per_pass`
// of them a pass. One program serves the three schedules:
//   kernels  ONLY_KERNEL is the kernel of this pass; rays that wait for another pass unchanged;
//   step     every ray runs the kernel that its own state asks for (1 step a pass: literal);
//   loop     as step, with the longest run of steps that the renderer's loops allow, so that one
//            pass, or very few, do it all.
// With START a pass sets the state up first; the literal schedules do that in a pass of no steps.
// Kernels nest as loops, each running on while rays want it: a renderer that executes both sides
// of a branch still skips a loop no ray is in (Aila and Laine, HPG 2009, call it while-while).

#include "common/fetch.glsl"
#include <streams>
#include <tables>
#include "common/stats.glsl"
#include "common/slack.glsl"
#include "common/ray.glsl"
#include "common/hit.glsl"
#include "common/box.glsl"
#include "common/triangle.glsl"
#include "common/phase.glsl"
#include <method>

uniform int steps_per_pass;
uniform int step_cap;

#ifdef ONLY_KERNEL
#define RUNS(kernel) (kernel == ONLY_KERNEL)
#else
#define RUNS(kernel) true
#endif

#define RUN(number, kernel) \
    while (RUNS(number) && state.phase == number && state.steps < limit) { \
        kernel(ray, state, hit); \
        ++state.steps; \
    }

bool runs(int phase) {
#ifdef ONLY_KERNEL
    return phase == ONLY_KERNEL;
#else
    return phase > DONE;
#endif
}

// A ray whose interval is empty, or that was marked invalid so, is done before it starts.
void start(Ray ray, out State state, out Hit hit) {
    hit = no_hit(ray.t_max);
#ifdef STATISTICS
    counters = Counters(0, 0, 0);
#endif
    init(ray, state);
    state.steps = 0;
    if (!(ray.t_min <= ray.t_max)) {
        state.phase = DONE;
    }
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Ray ray = ray_setup(rays_load(pixel));
    State state;
    Hit hit;
#ifdef START
    start(ray, state, hit);
#else
    state = state_load(pixel);
    hit = hit_load(pixel);
#ifdef STATISTICS
    counters = counters_load(pixel);
#endif
#endif

    int limit = min(state.steps + steps_per_pass, step_cap);
    while (runs(state.phase) && state.steps < limit) {
        RUN(1, KERNEL_1)
#ifdef KERNEL_2
        RUN(2, KERNEL_2)
#endif
#ifdef KERNEL_3
        RUN(3, KERNEL_3)
#endif
#ifdef KERNEL_4
        RUN(4, KERNEL_4)
#endif
    }
    if (state.phase > DONE && state.steps >= step_cap) {
        state.phase = UNFINISHED;
    }

    state_store(state);
    hit_store(hit);
#ifdef STATISTICS
    counters_store(counters);
#endif
}
