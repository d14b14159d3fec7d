// The signs of three volumes, each spanned by the ray and an edge, decide the test (Plucker coordinates;
// Amanatides and Choi 1997). Vertices are relative to the ray's origin. A volume counts as zero if its
// absolute value is at most `ulp` = 2 * ARITHMETIC_UNIT * |sum of the three volumes|.

void test_triangle(Ray ray, int i, inout Hit hit) {
    COUNT(triangles_tested);
    vec3 a = R(triangle_v0(i) - ray.origin);
    vec3 b = R(triangle_v1(i) - ray.origin);
    vec3 c = R(triangle_v2(i) - ray.origin);
    float w0 = R_dot(ray.direction, R_cross(c, b));
    float w1 = R_dot(ray.direction, R_cross(a, c));
    float w2 = R_dot(ray.direction, R_cross(b, a));
    float sum = R(R(w0 + w1) + w2);
    float ulp = 2.0 * ARITHMETIC_UNIT * abs(sum);
    vec3 normal = R_cross(R(b - a), R(c - a));
    float det = R_dot(ray.direction, normal);
    bool inside = min(min(w0, w1), w2) >= -ulp || max(max(w0, w1), w2) <= ulp;
    if (inside && det != 0.0 && sum != 0.0) {
        accept(ray, R(R_dot(a, normal) / det), R(w1 / sum), R(w2 / sum), triangle_index(i), hit);
    }
}
