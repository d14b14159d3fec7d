// Ray against triangle. Both tests read the same record and report u, v with
// p = (1 - u - v) v0 + u v1 + v v2; neither culls back faces, and a triangle without area is
// never hit.
//
// INTERSECTION_WOOP_WATERTIGHT: Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", JCGT 2013,
// without its double precision fallback. Each edge function is computed from its two vertices
// alone and only changes sign for the neighbour across the edge, so no ray slips between two
// triangles. The axes are permuted without a swap: both windings are accepted.
// We add that the ray must pass through the sheared triangle's box. Rounding never turns the sign of
// an edge function but can make it zero, and three zeros are a hit: without the box a tiny triangle
// is "hit" from far away. The comparisons are exact, so the box loses no ray that is inside.
//
// INTERSECTION_MOLLER_TRUMBORE: Moeller and Trumbore, "Fast, Minimum Storage Ray/Triangle
// Intersection", 1997, with the determinant compared to zero alone.

void accept(Ray ray, float t, float u, float v, int index, inout Hit hit) {
    if (t >= ray.t_min && (t < hit.t || (t == hit.t && index < hit.triangle))) {
        hit = Hit(t, u, v, index);
    }
}

#ifdef INTERSECTION_WOOP_WATERTIGHT

void test_triangle(Ray ray, int i, inout Hit hit) {
    COUNT(triangles_tested);
    PRECISE vec3 a = permute(ray, triangle_v0(i) - ray.origin);
    PRECISE vec3 b = permute(ray, triangle_v1(i) - ray.origin);
    PRECISE vec3 c = permute(ray, triangle_v2(i) - ray.origin);
    PRECISE vec2 sa = a.xy - ray.shear.xy * a.z;
    PRECISE vec2 sb = b.xy - ray.shear.xy * b.z;
    PRECISE vec2 sc = c.xy - ray.shear.xy * c.z;
    PRECISE float w0 = sc.x * sb.y - sc.y * sb.x;
    PRECISE float w1 = sa.x * sc.y - sa.y * sc.x;
    PRECISE float w2 = sb.x * sa.y - sb.y * sa.x;
    PRECISE float det = w0 + w1 + w2;
    float lowest = min(min(w0, w1), w2);
    float highest = max(max(w0, w1), w2);
    vec2 lo = min(min(sa, sb), sc);
    vec2 hi = max(max(sa, sb), sc);
    bool in_box = max(lo.x, lo.y) <= 0.0 && min(hi.x, hi.y) >= 0.0;
    if (in_box && (lowest >= 0.0 || highest <= 0.0) && det != 0.0) {
        PRECISE float inv_det = 1.0 / det;
        PRECISE float t = (w0 * a.z + w1 * b.z + w2 * c.z) * ray.shear.z * inv_det;
        accept(ray, t, w1 * inv_det, w2 * inv_det, triangle_index(i), hit);
    }
}

#endif
#ifdef INTERSECTION_MOLLER_TRUMBORE

void test_triangle(Ray ray, int i, inout Hit hit) {
    COUNT(triangles_tested);
    vec3 v0 = triangle_v0(i);
    vec3 e1 = triangle_v1(i) - v0;
    vec3 e2 = triangle_v2(i) - v0;
    vec3 p = cross(ray.direction, e2);
    float det = dot(e1, p);
    float inv_det = 1.0 / det;
    vec3 s = ray.origin - v0;
    float u = dot(s, p) * inv_det;
    vec3 q = cross(s, e1);
    float v = dot(ray.direction, q) * inv_det;
    if (det != 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0) {
        accept(ray, dot(e2, q) * inv_det, u, v, triangle_index(i), hit);
    }
}

#endif
