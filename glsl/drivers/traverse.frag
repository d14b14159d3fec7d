#version 330 core
// The driver of every single-ray method: runs the method's kernels on each ray's state, at most
// `steps_per_pass` of them in a pass. One program text serves the three schedules:
//   kernels  ONLY_KERNEL is the kernel of this pass; rays that wait for another kernel stay unchanged
//   step     every ray runs the kernel that its own state asks for (one step a pass)
//   loop     as step, with as many steps as the renderer's limit on loops allows, so one pass or very few
//            complete the traversal
// START sets up the state. Then SINGLE_STEP runs one step, MANY_STEPS runs `steps_per_pass`, and without
// either the pass ends.
//
// Each kernel is a loop of its own that runs while rays want the kernel. Aila and Laine, HPG 2009, call this
// while-while: a renderer that executes both sides of a branch still leaves a loop that no ray is in. Such a
// renderer runs the body of a loop that breaks at its top once more than rays want, with nothing to do.
// Loops here therefore test at their bottom (`if` and `do while`), and a single step has no loop at all.
// STEP_A_TURN runs one step in an iteration of the outer loop instead, as a program with one loop for all
// kernels does: the cost model of period hardware asks for it.

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

// A step ends with the values that the textures would hold, so all schedules give the same hits.
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

// Run each kernel that the ray waits for, in the order of the phases. EACH_KERNEL(F) stands for
// F(1, first kernel) F(2, second kernel) and so on.
void run_kernels(Ray ray, int limit, inout State state, inout Hit hit) {
    int phase = state.steps < limit ? state.phase : DONE;
    EACH_KERNEL(RUN)
}

// A ray with an empty interval is done before it starts. Invalid rays are given an empty interval.
void start(Ray ray, out State state, out Hit hit) {
    hit = no_hit(ray.t_max);
    CLEAR_COUNTERS;
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
    LOAD_COUNTERS(pixel);
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
    STORE_COUNTERS;
}
