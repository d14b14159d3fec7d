#version 330 core
// The driver of single-ray methods. It runs the method's kernels on each ray's state, at most
// `steps_per_pass` kernel steps in a pass. The three schedules share this text:
//   `kernels`: A pass runs one kernel, ONLY_KERNEL. Rays that wait for another kernel stay unchanged.
//   `step`: Each ray runs the kernel that its own state requests, by default one step per pass.
//   `loop`: As `step`, with as many steps in a pass as the renderer's limit on loops allows.
// START sets up the state. Then SINGLE_STEP runs one step, or MANY_STEPS runs `steps_per_pass` steps.
// Without either define the pass only sets up the state. The file <states> stores states in textures, or
// keeps them in registers.
//
// Each kernel has its own loop, which runs while rays need the kernel (while-while; Aila and Laine 2009).
// The reason: a renderer that executes both sides of every branch still skips a loop that no ray enters.
// Loops test at their bottom (`if` and `do while`): with a test at the top, such a renderer would execute
// the body one extra time, without effect.

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
#include <states>

uniform int steps_per_pass;
uniform int step_cap;

#ifdef ONLY_KERNEL
#define RUNS(kernel) (kernel == ONLY_KERNEL)
#else
#define RUNS(kernel) true
#endif

// Round the state after each step as a texture would, so that all schedules give the same hits.
#define STEP(kernel) \
    kernel(ray, state, hit); \
    ++state.steps; \
    state = state_stored(state); \
    hit = hit_stored(hit);

#ifdef SINGLE_STEP
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

// Run each kernel that the ray waits for, in the order of the phases.
void run_kernels(Ray ray, int limit, inout State state, inout Hit hit) {
    int phase = state.steps < limit ? state.phase : DONE;
    EACH_KERNEL(RUN)
}

// A ray with an empty interval is done before it starts. The interval of an invalid ray is empty.
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
    end_pass(state);
    hit_store(hit);
    STORE_COUNTERS;
}
