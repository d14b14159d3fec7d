// Moeller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997, with the determinant
// compared to zero instead of an epsilon.

void test_triangle(Ray ray, pointer i, inout Hit hit) {
    COUNT(triangles_tested);
    vec3 v0 = triangle_v0(i);
    vec3 e1 = R(triangle_v1(i) - v0);
    vec3 e2 = R(triangle_v2(i) - v0);
    vec3 p = R_cross(ray.direction, e2);
    float det = R_dot(e1, p);
    float inv_det = R(1.0 / det);
    vec3 s = R(ray.origin - v0);
    float u = R(R_dot(s, p) * inv_det);
    vec3 q = R_cross(s, e1);
    float v = R(R_dot(ray.direction, q) * inv_det);
    if (det != 0.0 && u >= 0.0 && v >= 0.0 && R(u + v) <= 1.0) {
        accept(ray, R(R_dot(e2, q) * inv_det), u, v, triangle_index(i), hit);
    }
}
