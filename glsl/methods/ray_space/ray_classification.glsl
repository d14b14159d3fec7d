// Ray classification: Arvo and Kirk, "Fast Ray Tracing by Ray Classification", SIGGRAPH 1987
// (survey, Table 1). One dependent lookup finds the list of what the rays of a ray's
// five-dimensional box may hit, sorted along their dominant axis; a candidate a step, until one
// begins behind the hit.
//
// Departure: back faces are kept, as every method here sees both sides. Their cache of the last
// box is the texture cache's work.

#include "methods/ray_space/ray_class.glsl"

// Whether the candidate begins behind the end of what is searched, by more than rounding can make.
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
