// Kensler and Shirley, "Optimizing Ray-Triangle Intersection via Automated Search", 2006: the variant with
// two cross products, one of them the normal.

void test_triangle(Ray ray, int i, inout Hit hit) {
    COUNT(triangles_tested);
    vec3 v0 = triangle_v0(i);
    vec3 e1 = R(triangle_v1(i) - v0);
    vec3 e2 = R(triangle_v2(i) - v0);
    vec3 normal = R_cross(e1, e2);
    float det = R_dot(ray.direction, normal);
    float inv_det = R(1.0 / det);
    vec3 s = R(v0 - ray.origin);
    vec3 r = R_cross(s, ray.direction);
    float u = R(R_dot(e2, r) * inv_det);
    float v = -R(R_dot(e1, r) * inv_det);
    if (det != 0.0 && u >= 0.0 && v >= 0.0 && R(u + v) <= 1.0) {
        accept(ray, R(R_dot(normal, s) * inv_det), u, v, triangle_index(i), hit);
    }
}
