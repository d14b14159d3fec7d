// Brute force: every ray tests every triangle, one triangle per step ("Brute" in Foley and Sugerman,
// "KD-Tree Acceleration Structures for a GPU Raytracer", Graphics Hardware 2005; survey, Figure 12).

#include "core/pointer.glsl"

uniform pointer triangle_count;   // the pointer behind the last triangle

void init(Ray ray, out State state) {
    state.cursor = FIRST;
    state.phase = triangle_count != FIRST ? INTERSECT : DONE;
}

void intersect(Ray ray, inout State state, inout Hit hit) {
    test_triangle(ray, state.cursor, hit);
    state.cursor = moved(state.cursor, 1);
    if (state.cursor == triangle_count || search_over(hit)) {
        state.phase = DONE;
    }
}
