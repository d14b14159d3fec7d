// Computes the start of a ray that leaves a hit. To keep the ray from hitting its own triangle, the start
// lies off the triangle by the error of the hit point plus the error of the triangle test. `spawn` in
// gpgpu_rt/reference/spawn.py computes the same start. `hit.triangle` must be a row of the triangle table.
//
// The error of the hit point. A unit is the relative error of one rounding. The point p = b0 v0 + u v1 + v
// v2 lies in the plane for any u and v if b0 = 1 - u - v. The rounded b0 has an absolute error of one unit
// (from 1 - u), plus one unit times b0. Each term is rounded by a product, by up to two sums, and by the
// addition of the offset. The texture may add two STORAGE_UNIT. The error along each axis is at most
//     (8 units + 2 STORAGE_UNIT) sum |b_i v_i| + 1 unit of |v0|.
// In pbrt, where b0 is not a difference, the bound is gamma(7) sum |b_i v_i|. Along the normal n the error
// is at most the sum of these bounds over the axes, weighted by |n|.
//
// The error of the triangle test. Let l be the distance from p to the farthest vertex. The test's t is the
// dot product of a corner and the scaled normal (core/watertight.glsl). This product has five roundings: of
// the subtraction of the origin, of the scaling, of the products and of two sums. Each rounding displaces
// the triangle along its normal by up to one unit times l on each axis. Eight units times l suffice for
// most triangles.
//
// Eight units are not enough for a long thin triangle that is oblique to the axes. The rounding of the
// normal adds 4 l k units. Here k is the product of the lengths of the two shorter edges, divided by twice
// the triangle's area (gpgpu_rt/numerics/error_bounds.py, step 7). Instead of adding this error, the code
// runs the test, and doubles the offset while the ray hits its own triangle. Then the code bisects between
// the largest offset that failed and the offset that succeeded, until the two differ by at most an eighth.

#ifndef STORAGE_UNIT
#define STORAGE_UNIT 0.0
#endif

const float FLOAT_UNIT = 5.9604645e-8;
const int SPAWN_TRIES = 28;   // enough for 21 doublings, from 8 units times l to l, and for the bisection

struct Spawn {
    vec3 point;
    vec3 normal;     // of unit length, on the side of the new ray
    float offset;
    float low;       // largest offset that has failed; before any failure, the first offset
    float high;      // smallest offset that has succeeded; before any success, INFINITE
    float most;      // largest offset to try
    int triangle;
};

Spawn spawn_setup(Hit hit, vec3 normal) {
    vec3 v0 = triangle_v0(hit.triangle);
    vec3 v1 = triangle_v1(hit.triangle);
    vec3 v2 = triangle_v2(hit.triangle);
    PRECISE float b0 = 1.0 - hit.u - hit.v;
    PRECISE vec3 p0 = b0 * v0;
    PRECISE vec3 p1 = hit.u * v1;
    PRECISE vec3 p2 = hit.v * v2;
    PRECISE vec3 point = p0 + p1 + p2;
    vec3 error = (8.0 * FLOAT_UNIT + 2.0 * STORAGE_UNIT) * (abs(p0) + abs(p1) + abs(p2))
               + FLOAT_UNIT * abs(v0);
    vec3 off = abs(normal) * error;
    vec3 reach = max(max(abs(v0 - point), abs(v1 - point)), abs(v2 - point));
    float most = max(max(reach.x, reach.y), reach.z);
    float seen = 8.0 * ARITHMETIC_UNIT * most;
    float least = off.x + off.y + off.z + seen;
    return Spawn(point, normal, least, least, INFINITE, most, hit.triangle);
}

// The origin at the current offset, rounded as a ray texture will hold it.
vec3 spawn_origin(Spawn spawn) {
    PRECISE vec3 shift = spawn.normal * spawn.offset;
    PRECISE vec3 origin = spawn.point + shift;
    return stored(origin);
}

float least_of(uint dropped, float smallest, float quantum, float most) {
    return quantum;
}

// The smallest t_min above 0 that ray texture and arithmetic can hold. This t_min excludes hits at t = 0: a
// ray that starts off its surface finds such a hit only by underflow.
float spawn_t_min() {
    float t_min = 1.17549435e-38;
#ifdef STORAGE_FORMAT
    t_min = max(t_min, least_of(STORAGE_FORMAT));
#endif
#ifdef ARITHMETIC_FORMAT
    t_min = max(t_min, least_of(ARITHMETIC_FORMAT));
#endif
    return t_min;
}

// Choose the next offset: double it while the ray hits its own triangle, then bisect. Return whether the
// offset has changed. The final offset succeeds, unless the largest offset fails.
bool spawn_further(inout Spawn spawn, bool hits_itself) {
    spawn.low = hits_itself ? spawn.offset : spawn.low;
    spawn.high = hits_itself ? spawn.high : spawn.offset;
    float next = 2.0 * spawn.offset <= spawn.most ? 2.0 * spawn.offset : spawn.offset;
    if (spawn.high < INFINITE) {
        float gap = spawn.high - spawn.low;
        next = 8.0 * gap > spawn.high ? spawn.low + 0.5 * gap : spawn.high;
    }
    bool further = next != spawn.offset;
    spawn.offset = next;
    return further;
}

// Whether the ray, rounded as its texture will hold it, hits the triangle that it leaves.
bool spawn_hits_itself(Spawn spawn, Rays texels) {
    Hit hit = no_hit(INFINITE);
    test_triangle(ray_setup(texels), spawn.triangle, hit);
    return hit_found(hit);
}
