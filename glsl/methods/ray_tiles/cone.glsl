// Tests spheres around triangles against cones around rays. Szecsi, "The Hierarchical Ray Engine", WSCG
// 2006 (survey, section 3.6, Figure 23).
//
// A cone holds rays o + t d, t >= 0, with |o - apex| <= radius and cos(d, axis) >= cosine. For a point p on
// such a ray, p - (o - apex) lies in the point cone, the cone of the rays that begin at the apex itself. If
// a ray meets a sphere, the distance of the sphere's centre from the point cone is at most `radius` plus
// the sphere's own radius. Let v be centre - apex, with parts h and s along and across the axis. The
// distance from the centre to the cone's side is s cosine - h sine, which is negative inside the cone. For
// a centre behind the apex, the distance to the cone is |v|. The paper's test is s <= h tan + r / cos. Here
// r is the sum of both radii, and the paper writes |P - H| for s. Multiplied by the cosine, the inequality
// becomes the test of this file, which has no pole at a right angle.
//
// Departures: `reach` rejects spheres beyond the ends of all rays. If the cone's cosine is at most 0, the
// cone rejects no other sphere. With `lines` the rays also extend backwards (t_min < 0), and the test uses
// |h|.
//
// Rounding, in units u = 2^-24. All lengths are divided by the largest component m of v, so |v| <= sqrt(3)
// and nothing overflows. The error of v is at most 4u, and the axis is within 4u of unit length. So h and s
// have errors of at most 16u. A cross product gives s, so no squares cancel. The sine is within 4u of the
// sine that belongs to the cosine, because 1 - cosine is exact for a cosine near 1. The products and the
// difference have errors below 48u. The radii have relative errors below 8u. MARGIN is more than twice the
// sum of all these errors. The pass that made the cone has lowered the cosine by the errors of the cosine
// and of the directions (methods/ray_tiles/tile_cones.frag).

const float MARGIN = 128.0 * 5.9604645e-8;
const float TINY = 1e-30;   // below this length, squares of components underflow

float largest_size(vec3 v) {
    return max(max(abs(v.x), abs(v.y)), abs(v.z));
}

// An upper bound on the length of a vector, even if squares of its components underflow or overflow.
float length_above(vec3 v) {
    float m = largest_size(v);
    return m < TINY ? 2.0 * m : m * (length(v / m) * (1.0 + 1e-6));
}

// Whether no ray of the cone meets the sphere around a triangle. With `bounded`, the rays end at `reach`.
// If a value is NaN, the sphere counts as met.
bool cone_misses(vec3 apex, float radius, vec3 axis, float cosine, float reach, bool bounded,
                 bool lines, vec3 a, vec3 b, vec3 c) {
    if (reach < 0.0) {
        return true;
    }
    vec3 centre = 0.5 * min(min(a, b), c) + 0.5 * max(max(a, b), c);
    vec3 v = centre - apex;
    float m = largest_size(v);
    if (m < TINY) {
        return false;
    }
    v /= m;
    float sphere = max(max(length_above((a - centre) / m), length_above((b - centre) / m)),
                       length_above((c - centre) / m));
    float together = (sphere + radius / m) * (1.0 + MARGIN) + MARGIN;
    float away = length(v);
    if (bounded && away > together + reach / m * (1.0 + MARGIN)) {
        return true;
    }
    if (!(cosine > 0.0)) {
        return false;
    }
    float sine = sqrt((1.0 - cosine) * (1.0 + cosine));
    float h = dot(v, axis);
    float s = length(cross(v, axis));
    h = lines ? abs(h) : h;
    bool behind = h * cosine + s * sine < 0.0;
    return (behind ? away : s * cosine - h * sine) > together;
}
