// Brute force: every ray tests every triangle, one triangle per step ("Brute" in Foley and Sugerman,
// "KD-Tree Acceleration Structures for a GPU Raytracer", Graphics Hardware 2005; survey, Figure 12).

uniform int triangle_count;

void init(Ray ray, out State state) {
    state.cursor = 0;
    state.phase = triangle_count > 0 ? INTERSECT : DONE;
}

void intersect(Ray ray, inout State state, inout Hit hit) {
    test_triangle(ray, state.cursor, hit);
    ++state.cursor;
    if (state.cursor == triangle_count || search_over(hit)) {
        state.phase = DONE;
    }
}
