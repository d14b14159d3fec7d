// sweep, an example: triangles are sorted along an axis and cut into runs (see sweep.py beside this file).
//
// A ray visits the runs in the order of its direction along the axis. Each run's box is widened
// (core/slack.glsl). rest_begins uses the same expression as the slab test (core/box.glsl), so a ray exits
// early only if the slab test would reject every remaining box.

uniform int run_count;

void init(Ray ray, out State state) {
    state.passed = 0;
    state.cursor = 0;
    state.phase = run_count > 0 ? PASS_RUN : DONE;
}

bool goes_back(Ray ray) {
    return ray.inv_dir[AXIS] < 0.0;
}

// The smallest t at which the ray can enter `run` or a run that it visits later.
float rest_begins(Ray ray, int run) {
    float from = goes_back(ray) ? R(sweep_run_most(run) - ray.hi_origin[AXIS])
                                : R(sweep_run_least(run) - ray.lo_origin[AXIS]);
    return R(from * ray.inv_dir[AXIS]);
}

void pass_run(Ray ray, inout State state, inout Hit hit) {
    COUNT(nodes_visited);
    int run = goes_back(ray) ? run_count - 1 - state.passed : state.passed;
    ++state.passed;
    if (rest_begins(ray, run) > hit.t) {
        state.phase = DONE;
        return;
    }
    vec2 interval = box_interval(ray, sweep_run_lo(run), sweep_run_hi(run));
    if (max(interval.x, ray.t_min) <= min(interval.y, hit.t)) {
        COUNT(leaves_visited);
        state.cursor = sweep_run_first(run);
        state.phase = INTERSECT;
    } else if (state.passed == run_count) {
        state.phase = DONE;
    }
}

void intersect(Ray ray, inout State state, inout Hit hit) {
    int i = state.cursor;
    test_triangle(ray, i, hit);
    ++state.cursor;
    if (search_over(hit)) {
        state.phase = DONE;
    } else if (triangle_last(i) != 0) {
        state.phase = state.passed < run_count ? PASS_RUN : DONE;
    }
}
