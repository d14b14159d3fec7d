// Ray classification: Arvo and Kirk, "Fast Ray Tracing by Ray Classification", SIGGRAPH 1987 (survey,
// section 5). A box of rays holds the rays with similar origins (three numbers) and similar directions (two
// numbers). Its candidates, the triangles that its rays may hit, are sorted along the rays' dominant axis.
// Each step tests one candidate. The search ends when a candidate begins behind the hit.
//
// Departures: back faces are kept, because every method here hits both sides. The texture cache replaces
// the paper's cache of the last box.

#include "methods/ray_space/ray_class.glsl"

// Whether the candidate begins behind the end of the search, by more than rounding can explain.
bool begins_behind(Ray ray, float near, float t_end) {
    float along = permute(ray, ray.direction).z;
    float ahead = along < 0.0 ? R(near + permute(ray, ray.hi_origin).z)
                              : R(near - permute(ray, ray.lo_origin).z);
    return ahead > R(t_end * abs(along));
}

void init(Ray ray, out State state) {
    COUNT(nodes_visited);
    int box = box_of(ray);
    state.cursor = -1;
    state.phase = DONE;
    if (box >= 0) {
        COUNT(leaves_visited);
        state.cursor = ray_box_first(box);
        state.phase = INTERSECT;
    }
}

void intersect(Ray ray, inout State state, inout Hit hit) {
    int triangle = candidate_triangle(state.cursor);
    if (triangle < 0 || begins_behind(ray, candidate_near(state.cursor), hit.t)) {
        state.phase = DONE;
        return;
    }
    COUNT(nodes_visited);
    test_triangle(ray, triangle, hit);
    ++state.cursor;
    if (search_over(hit)) {
        state.phase = DONE;
    }
}
