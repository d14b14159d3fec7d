// Spheres against cones around rays: the hierarchical ray engine's test. Szecsi, "The Hierarchical
// Ray Engine", WSCG 2006 (survey, section 3.6, Figure 23).
//
// A cone holds rays o + t d, t >= 0, with |o - apex| <= radius and cos(d, axis) >= cosine. A point p
// on such a ray has p - (o - apex) in the cone with the apex for its only origin, so a sphere that a
// ray meets has its centre within radius + sphere of that cone. With v = centre - apex, h its part
// along the axis and s its part across, the centre's distance to the cone's side is
// s cosine - h sine, negative inside; to the apex, where it lies behind it, |v|. The paper's
// |P - H| <= h tan + r / cos is this times cosine, which has no pole at a right angle.
//
// Departures: a cone without cosine > 0 keeps everything; `reach` rejects what lies beyond all that
// the rays still search; with `lines` the rays also go backwards (t_min < 0), which takes |h|.
//
// Rounding, in units u = 2^-24, with all lengths divided by the largest component m, so that |v| <=
// sqrt(3) and nothing overflows: v is within 4u of the vector that it stands for, the axis within 4u
// of unit length, so that h and s (from a cross product: no cancellation of squares) are within 16u.
// The sine is within 4u of that of the cosine, as 1 - cosine is exact near 1. Their products and the
// difference: less than 48u. The radii's own rounding is a share of them, below 8u. MARGIN is twice
// that and more. The cosine was lowered before, by what it and the directions are off
// (methods/ray_tiles/tile_cones.frag).

const float MARGIN = 128.0 * 5.9604645e-8;
const float TINY = 1e-30;   // lengths below: squares of parts of them vanish

float largest(vec3 v) {
    return max(max(abs(v.x), abs(v.y)), abs(v.z));
}

// A bound on the length from above, for vectors whose squares would vanish or overflow too.
float length_above(vec3 v) {
    float m = largest(v);
    return m < TINY ? 2.0 * m : m * (length(v / m) * (1.0 + 1e-6));
}

// Whether no ray of the cone meets the sphere around a triangle; `bounded`: within its reach. What is
// not a number is met.
bool cone_misses(vec3 apex, float radius, vec3 axis, float cosine, float reach, bool bounded,
                 bool lines, vec3 a, vec3 b, vec3 c) {
    if (reach < 0.0) {
        return true;
    }
    vec3 centre = 0.5 * min(min(a, b), c) + 0.5 * max(max(a, b), c);
    vec3 v = centre - apex;
    float m = largest(v);
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
