// Ray against triangle. All tests read the same record and report u and v of the hit point p = (1 - u - v)
// v0 + u v1 + v v2. No test culls back faces, and a triangle without area is never hit.
//
// INTERSECTION_WOOP_WATERTIGHT: Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", JCGT 2013,
// without its fallback to a wider format. An edge function depends on its two vertices only. The neighbour
// across the edge computes the same value with the opposite sign, so no ray leaks between two triangles.
// The paper swaps two axes to keep the winding; here they are not swapped, because both windings are
// accepted. Addition: the ray must also pass through the sheared triangle's box. Rounding never flips the
// sign of an edge function but can make it zero, and three zeros count as a hit. Without the box a tiny
// triangle would be "hit" from far away. The box test loses no hit: its comparisons are exact.
//
// INTERSECTION_MOLLER_TRUMBORE: Moeller and Trumbore, "Fast, Minimum Storage Ray/Triangle
// Intersection", 1997. Here the determinant is compared to zero and not to an epsilon.
//
// INTERSECTION_PLUCKER: signed volumes of the ray and each edge (Plucker coordinates; Amanatides and
// Choi 1997), with vertices relative to the ray's origin. A volume counts as zero if its absolute value is
// at most one ulp of the sum of the three volumes.
//
// INTERSECTION_KENSLER_SHIRLEY: Kensler and Shirley, "Optimizing Ray-Triangle Intersection via
// Automated Search", 2006: the variant with two cross products, one of which is the normal.

#ifdef IMAGE_CELLS
#include "methods/geometry_image/image_triangles.glsl"
#endif

// Keep a hit if it comes before the nearest hit so far in the order of (t, index). A ray that continues
// behind a hit (AFTER_HIT) has the hit's t as t_min; at exactly this t it accepts only triangles with a
// higher index. The era form (ERA, docs/era.md) compares only t, as the papers' kernels did.
void accept(Ray ray, float t, float u, float v, int index, inout Hit hit) {
#ifdef AFTER_HIT
    bool ahead = t > ray.t_min || (t == ray.t_min && index > ray.after);
#else
    bool ahead = t >= ray.t_min;
#endif
#ifdef ERA
    if (ahead && t < hit.t) {
#else
    if (ahead && (t < hit.t || (t == hit.t && index < hit.triangle))) {
#endif
        hit = Hit(t, u, v, index);
    }
}

#ifdef INTERSECTION_WOOP_WATERTIGHT

// Shear space so that the ray becomes the z axis, and return a corner there: x and y are the corner's
// offset from the ray, z is its depth. The corner p is relative to the ray's origin and has permuted axes.
vec3 sheared(Ray ray, vec3 p) {
    PRECISE vec2 xy = R(p.xy - R(ray.shear.xy * p.z));
    return vec3(xy, p.z);
}

float edge_function(vec3 p, vec3 q) {
    PRECISE float area = R(R(p.x * q.y) - R(p.y * q.x));
    return area;
}

// These functions find the signs of three numbers by comparing the numbers' bits as integers, which is
// fastest. llvmpipe's minimum of floats also checks for NaN, and comparisons joined by `and` wait for one
// another. A NaN may count as any sign, because det and t are then NaN too and nothing is hit.

// As an unsigned integer, greater than the bits of every float whose sign bit is 0.
const uint MINUS_ZERO = 0x80000000u;

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

// Test triangle i, whose corners are relative to the origin with permuted axes.
void test_corners(Ray ray, vec3 v0, vec3 v1, vec3 v2, int i, inout Hit hit) {
    vec3 a = sheared(ray, v0);
    vec3 b = sheared(ray, v1);
    vec3 c = sheared(ray, v2);
    float w0 = edge_function(c, b);
    float w1 = edge_function(a, c);
    float w2 = edge_function(b, a);
    PRECISE float det = R(R(w0 + w1) + w2);
    vec3 w = vec3(w0, w1, w2);
    bool inside = none_below_zero(w) || none_above_zero(w);
    vec3 x = vec3(a.x, b.x, c.x);
    vec3 y = vec3(a.y, b.y, c.y);
    bool beside = all_above_zero(x) || all_below_zero(x);
    bool over = all_above_zero(y) || all_below_zero(y);
    if (inside && !beside && !over && det != 0.0) {
        PRECISE float inv_det = R(1.0 / det);
        PRECISE float depth = R(R(R(w0 * a.z) + R(w1 * b.z)) + R(w2 * c.z));
        PRECISE float t = R(R(depth * ray.shear.z) * inv_det);
        accept(ray, t, R(w1 * inv_det), R(w2 * inv_det), triangle_index(i), hit);
    }
}

// The corner with permuted axes, relative to `start`, the origin with permuted axes.
vec3 seen_from(vec3 start, bvec2 dominant, vec3 corner) {
    PRECISE vec3 p = R(permuted(dominant, corner) - start);
    return p;
}

void test_triangle(Ray ray, int i, inout Hit hit) {
    COUNT(triangles_tested);
    vec3 start = permute(ray, ray.origin);
    test_corners(ray, seen_from(start, ray.dominant, triangle_v0(i)),
                 seen_from(start, ray.dominant, triangle_v1(i)),
                 seen_from(start, ray.dominant, triangle_v2(i)), i, hit);
}

#endif
#ifdef INTERSECTION_MOLLER_TRUMBORE

void test_triangle(Ray ray, int i, inout Hit hit) {
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

#endif
#ifdef INTERSECTION_PLUCKER

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

#endif
#ifdef INTERSECTION_KENSLER_SHIRLEY

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

#endif
