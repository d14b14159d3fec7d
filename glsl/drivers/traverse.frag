#version 330 core
// The driver of every method: runs the method's kernels on each ray's state, up to `steps_per_pass`
// of them a pass. One program serves the three schedules:
//   kernels  ONLY_KERNEL is the kernel of this pass; rays that wait for another pass unchanged;
//   step     every ray runs the kernel that its own state asks for (1 step a pass: literal);
//   loop     as step, with the longest run of steps that the renderer's loops allow, so that one
//            pass, or very few, do it all.
// START sets the state up; then SINGLE_STEP runs one step, MANY_STEPS `steps_per_pass`, or else none.
//
// Kernels nest as loops, each running on while rays want it: a renderer that executes both sides
// of a branch still leaves a loop that no ray is in (Aila and Laine, HPG 2009, call it
// while-while). Such a renderer runs the body of a loop that breaks at its top once more than rays
// want, with nothing to do: hence `if` and `do while`, and for a single step no loop at all.
// STEP_A_TURN takes one step a turn of the outer loop instead, as a program does that has one loop
// for all: the cost model of period hardware asks for it.

#include "core/precision.glsl"
#include "core/fetch.glsl"
#include <streams>
#include <tables>
#include "core/stats.glsl"
#include "core/slack.glsl"
#include "core/ray.glsl"
#include "core/hit.glsl"
#include "core/box.glsl"
#include "core/triangle.glsl"
#include "core/phase.glsl"
#include <method>

uniform int steps_per_pass;
uniform int step_cap;

#ifdef ONLY_KERNEL
#define RUNS(kernel) (kernel == ONLY_KERNEL)
#else
#define RUNS(kernel) true
#endif

// A step leaves what the textures would hold, so that all schedules give the same hits.
#define STEP(kernel) \
    kernel(ray, state, hit); \
    ++state.steps; \
    state = state_stored(state); \
    hit = hit_stored(hit);

#if defined(SINGLE_STEP) || defined(STEP_A_TURN)
#define RUN(number, kernel) \
    if (RUNS(number) && phase == number) { \
        STEP(kernel) \
    }
#else
#define RUN(number, kernel) \
    if (state.phase == number && state.steps < limit) { \
        do { \
            STEP(kernel) \
        } while (state.phase == number && state.steps < limit); \
    }
#endif

// Each kernel that the ray is in for, in the order of their phases.
void run_kernels(Ray ray, int limit, inout State state, inout Hit hit) {
    int phase = state.steps < limit ? state.phase : DONE;
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
    state = state_stored(state);
    hit = hit_stored(hit);
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

#ifdef SINGLE_STEP
    run_kernels(ray, step_cap, state, hit);
#elif defined(MANY_STEPS)
    int limit = min(state.steps + steps_per_pass, step_cap);
    do {
        run_kernels(ray, limit, state, hit);
    } while (state.phase > DONE && state.steps < limit);
#endif
    if (state.phase > DONE && state.steps >= step_cap) {
        state.phase = UNFINISHED;
    }

    state_store(state);
    hit_store(hit);
#ifdef STATISTICS
    counters_store(counters);
#endif
}
