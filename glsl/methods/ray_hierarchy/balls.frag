#version 330 core
// Computes the centre and radius of a small ball around each triangle, in the hierarchy's units
// (cone_units.glsl). The centre is the circumcentre, or the midpoint of the longest side if an angle has at
// least 90 degrees or the triangle is very thin. The radius is measured from the rounded centre and then
// widened, so the ball encloses the triangle despite rounding. Without PRECISE, a compiler could simplify
// `a - (x + a)` to `-x`, the distance from the exact centre.

#include "core/precision.glsl"
#include "core/stream.glsl"
#include <tables>
#include <records>
#include "methods/ray_hierarchy/cone_units.glsl"

void main() {
    int i = element();
    vec3 a = unit * triangle_v0(i);
    vec3 ab = unit * triangle_v1(i) - a;
    vec3 ac = unit * triangle_v2(i) - a;
    vec3 bc = ac - ab;
    float b = dot(ab, ab), c = dot(ac, ac), across = dot(ab, ac);
    float opposite = dot(bc, bc);
    float area = b * c - across * across;   // four times the squared area
    vec3 centre = 0.5 * ab;                 // the midpoint of the longest side
    if (opposite >= b && opposite >= c) {
        centre = 0.5 * (ab + ac);
    } else if (c >= b) {
        centre = 0.5 * ac;
    }
    bool acute = across > 0.0 && b > across && c > across && area > 1e-4 * b * c;
    if (acute) {
        centre = (c * (b - across) * ab + b * (c - across) * ac) / (2.0 * area);
    }
    PRECISE vec3 middle = centre + a;
    PRECISE vec3 to_v0 = a - middle;
    PRECISE vec3 to_v1 = unit * triangle_v1(i) - middle;
    PRECISE vec3 to_v2 = unit * triangle_v2(i) - middle;
    float radius = max(max(length(to_v0), length(to_v1)), length(to_v2));
    ball_store(Ball(vec4(middle, radius * WIDENED + TINY)));
}
