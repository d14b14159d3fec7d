// The pair test of the Ray Engine in the fixed point of its cards (Carr, Hall, Hart 2002): 16 bits in
// [-8, 8) on the Radeon 8500, 9 bits in [-1, 1] on the GeForce4. Every result is rounded to a multiple of
// `fixed_step` and kept within the range, so t is coarse, and a ray near an edge may miss both triangles.
//
// Departure: this test is a reconstruction, because the paper's program is not known to this project. The
// host scales the scene into the range. It attaches to each triangle its unit normal and the unit normals of
// its edges: in these formats a determinant of small edges would be zero. A quotient stands for a lookup
// texture. u and v are not rounded, because the cards' programs did not interpolate with them.

#include "core/triangle.glsl"

uniform vec3 fixed_centre;    // of the scene's box
uniform float fixed_scale;    // units of the card a world unit
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

// A point of the world in the card's units.
vec3 placed(vec3 p) {
    return F((p - fixed_centre) * fixed_scale);
}

// The distance of a point from the edge that begins at `from`, towards the inside of the triangle.
float inside_edge(vec3 point, vec3 from, vec3 to, vec3 normal) {
    vec3 across = F(normalize(cross(normal, to - from)));
    return F_dot(across, F(point - from));
}

void test_pair(Ray ray, int i, inout Hit hit) {
    vec3 v0 = placed(triangle_v0(i));
    vec3 v1 = placed(triangle_v1(i));
    vec3 v2 = placed(triangle_v2(i));
    vec3 area = cross(v1 - v0, v2 - v0);
    if (dot(area, area) == 0.0) {
        return;    // in these numbers the triangle is a line
    }
    vec3 normal = F(normalize(area));
    float speed = length(ray.direction);
    vec3 origin = placed(ray.origin);
    vec3 direction = F(ray.direction / speed);
    float facing = F_dot(normal, direction);
    if (facing == 0.0) {
        return;
    }
    PRECISE float t = F(F_dot(normal, F(v0 - origin)) / facing);
    vec3 point = F(origin + F(t * direction));
    vec3 w = vec3(inside_edge(point, v1, v2, normal), inside_edge(point, v2, v0, normal),
                  inside_edge(point, v0, v1, normal));
    if (min(min(w.x, w.y), w.z) >= 0.0) {
        vec3 p = cross(v2 - v0, point - v0);
        vec3 q = cross(point - v0, v1 - v0);
        float u = clamp(-dot(p, area) / dot(area, area), 0.0, 1.0);
        float v = clamp(-dot(q, area) / dot(area, area), 0.0, 1.0 - u);
        accept(ray, t / (speed * fixed_scale), u, v, triangle_index(i), hit);
    }
}
