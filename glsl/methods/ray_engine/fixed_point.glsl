// Tests a ray and a triangle in the fixed point of the Ray Engine's cards (Carr, Hall, Hart 2002): 16 bits
// in [-8, 8) on the Radeon 8500, 9 bits in [-1, 1] on the GeForce4. Every result is rounded to a multiple
// of `fixed_step` and clamped to the range. So t is coarse, and rays may pass between adjacent triangles.
//
// Departure: this test is a reconstruction, because the paper's program is not known to this project. We
// assume that the paper's host scaled the scene into the range, and sent unit normals of the triangle and
// its edges with each quad. With edges instead of unit normals, the products of small edges would be zero
// in fixed point. Here the shader computes the normals, in float32. It also divides; such a card would have
// used a lookup texture. u and v are not rounded, because they do not decide which triangle is hit.

#include "core/triangle.glsl"

uniform vec3 fixed_centre;    // centre of the scene's box
uniform float fixed_scale;    // units of the card per world unit
uniform float fixed_step;
uniform float fixed_least;
uniform float fixed_most;

float F(float x) {
    return clamp(roundEven(x / fixed_step) * fixed_step, fixed_least, fixed_most);
}

vec3 F(vec3 v) {
    return vec3(F(v.x), F(v.y), F(v.z));
}

float F_dot(vec3 a, vec3 b) {
    PRECISE vec3 p = F(a * b);
    return F(F(p.x + p.y) + p.z);
}

// A point of the world in the card's units, before the host rounds the point.
vec3 scaled(vec3 p) {
    PRECISE vec3 q = (p - fixed_centre) * fixed_scale;
    return q;
}

// The unit normal of the edge between two corners, towards the inside of the triangle.
vec3 edge_normal(vec3 from, vec3 to, vec3 normal) {
    PRECISE vec3 across = normalize(cross(normal, to - from));
    return F(across);
}

void test_pair(Ray ray, int i, inout Hit hit) {
    vec3 v0 = scaled(triangle_v0(i));
    vec3 v1 = scaled(triangle_v1(i));
    vec3 v2 = scaled(triangle_v2(i));
    PRECISE vec3 area = cross(v1 - v0, v2 - v0);
    if (dot(area, area) == 0.0) {
        return;
    }
    PRECISE vec3 normal = normalize(area);
    PRECISE float speed = length(ray.direction);
    PRECISE vec3 towards = ray.direction / speed;
    vec3 origin = F(scaled(ray.origin));
    vec3 direction = F(towards);
    float facing = F_dot(F(normal), direction);
    if (facing == 0.0) {
        return;
    }
    PRECISE float t = F(F_dot(F(normal), F(F(v0) - origin)) / facing);
    PRECISE vec3 way = t * direction;
    vec3 point = F(origin + F(way));
    vec3 w = vec3(F_dot(edge_normal(v1, v2, normal), F(point - F(v1))),
                  F_dot(edge_normal(v2, v0, normal), F(point - F(v2))),
                  F_dot(edge_normal(v0, v1, normal), F(point - F(v0))));
    if (min(min(w.x, w.y), w.z) >= 0.0) {
        float u = clamp(dot(cross(point - v0, v2 - v0), area) / dot(area, area), 0.0, 1.0);
        float v = clamp(dot(cross(v1 - v0, point - v0), area) / dot(area, area), 0.0, 1.0 - u);
        PRECISE float t_world = t / (speed * fixed_scale);
        accept(ray, t_world, u, v, triangle_index(i), hit);
    }
}
