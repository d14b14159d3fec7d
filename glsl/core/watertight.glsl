// The triangle test of Woop, Benthin and Wald: "Watertight Ray/Triangle Intersection", JCGT 2013. It lacks
// the paper's fallback to a wider format. An edge function depends on its two vertices only. The triangle
// across the edge computes the same value with the opposite sign, so no ray leaks between these triangles.
//
// Departures:
// 1. The paper swaps two axes to keep the winding. Here both windings are accepted.
// 2. The ray must also pass through the sheared triangle's box, by exact comparisons. An edge function that
//    rounds to zero counts for both signs, so without the box a tiny triangle would be "hit" from far away.
// 3. The paper interpolates t from the depths of the sheared corners, a sum whose terms cancel near a long
//    thin triangle. Here t is the distance of the triangle's plane, clamped to the range of the depths.

// Return a corner sheared so that the ray is the z axis: x and y are the offset from the ray, and z is the
// depth. The corner p is relative to the ray's origin and has permuted axes.
vec3 sheared(Ray ray, vec3 p) {
    PRECISE vec2 xy = R(p.xy - R(ray.shear.xy * p.z));
    return vec3(xy, p.z);
}

float edge_function(vec3 p, vec3 q) {
    PRECISE float area = R(R(p.x * q.y) - R(p.y * q.x));
    return area;
}

// Find the signs of three numbers by comparing their bits as integers, which is faster on llvmpipe. A NaN's
// sign does not matter: `det` is then NaN too, so nothing is hit.
const uint MINUS_ZERO = 0x80000000u;   // greater than the bits of every float whose sign bit is 0
const float LEAST_NORMAL = uintBitsToFloat(0x00800000u);   // 2^-126; below, 1 / x may be infinite

bool none_below_zero(vec3 v) {
    uvec3 bits = floatBitsToUint(v);
    return max(max(bits.x, bits.y), bits.z) <= MINUS_ZERO;
}

bool none_above_zero(vec3 v) {
    ivec3 bits = floatBitsToInt(v);
    return max(max(bits.x, bits.y), bits.z) <= 0;
}

bool all_above_zero(vec3 v) {
    ivec3 bits = floatBitsToInt(v);
    return min(min(bits.x, bits.y), bits.z) > 0;
}

bool all_below_zero(vec3 v) {
    uvec3 bits = floatBitsToUint(v);
    return min(min(bits.x, bits.y), bits.z) > MINUS_ZERO;
}

// Return the normal of triangle i, with permuted axes. The two shorter edges give the most exact cross
// product. They meet at v0 if apex.x, else at v1 if apex.y, else at v2.
vec3 plane_normal(int i, bvec2 axes, out bvec2 apex) {
    vec3 e0 = R(triangle_v2(i) - triangle_v1(i));
    vec3 e1 = R(triangle_v0(i) - triangle_v2(i));
    vec3 e2 = R(triangle_v1(i) - triangle_v0(i));
    vec3 size = vec3(largest(abs(e0)), largest(abs(e1)), largest(abs(e2)));
    apex = bvec2(size.x >= size.y && size.x >= size.z, size.y >= size.z);
    return permuted(axes, R_cross(apex.x ? e1 : e0, apex.x || apex.y ? e2 : e1));
}

// Return the t of the plane through `point`, clamped to the range of the corners' t (`depths`). The
// division comes first, because a product of three lengths could leave the range of float32.
float plane_distance(Ray ray, vec3 normal, vec3 point, vec3 depths) {
    float inverse = R(1.0 / R_dot(permute(ray, ray.direction), normal));
    PRECISE float t = R_dot(point, R(normal * inverse));
    float nearest = min(min(depths.x, depths.y), depths.z);
    float furthest = largest(depths);
    return t > nearest ? (t < furthest ? t : furthest) : nearest;   // nearest, if t is not a number
}

// Test triangle i. The corners are relative to the origin. Corners and normal have permuted axes.
void test_corners(Ray ray, int i, vec3 v0, vec3 v1, vec3 v2, vec3 normal, bvec2 apex, inout Hit hit) {
    vec3 a = sheared(ray, v0);
    vec3 b = sheared(ray, v1);
    vec3 c = sheared(ray, v2);
    vec3 w = vec3(edge_function(c, b), edge_function(a, c), edge_function(b, a));
    PRECISE float det = R(R(w.x + w.y) + w.z);
    bool inside = none_below_zero(w) || none_above_zero(w);
    vec3 x = vec3(a.x, b.x, c.x);
    vec3 y = vec3(a.y, b.y, c.y);
    bool beside = all_above_zero(x) || all_below_zero(x);
    bool over = all_above_zero(y) || all_below_zero(y);
    if (inside && !beside && !over && abs(det) >= LEAST_NORMAL) {
        PRECISE float inv_det = R(1.0 / det);
        PRECISE vec3 depths = R(vec3(a.z, b.z, c.z) * ray.shear.z);
        float t = plane_distance(ray, normal, apex.x ? v0 : apex.y ? v1 : v2, depths);
        accept(ray, t, R(w.y * inv_det), R(w.z * inv_det), triangle_index(i), hit);
    }
}

// Permute the axes of a corner, and return its place relative to `start`, the origin with permuted axes.
vec3 seen_from(vec3 start, bvec2 axes, vec3 corner) {
    PRECISE vec3 p = R(permuted(axes, corner) - start);
    return p;
}

void test_triangle(Ray ray, int i, inout Hit hit) {
    COUNT(triangles_tested);
    vec3 start = permute(ray, ray.origin);
    bvec2 apex;
    vec3 normal = plane_normal(i, ray.dominant, apex);
    test_corners(ray, i, seen_from(start, ray.dominant, triangle_v0(i)),
                 seen_from(start, ray.dominant, triangle_v1(i)),
                 seen_from(start, ray.dominant, triangle_v2(i)), normal, apex, hit);
}
