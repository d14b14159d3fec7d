// Which pixels' eye rays a triangle can be hit by, at most, and how near: what lets the rasteriser's
// first hits be relied on. Nothing here is exact and nothing needs to be; all of it errs to the same
// side.
//
// A triangle that test_triangle accepts for the ray through a pixel's centre lies, projected, at
// most `margin` pixels from that centre, if all its corners are at least `nearest` deep. Errors are
// taken sixteen times as large as their first terms:
//   eta     how far a projected corner may be off, or seem to be for the test: roundings of the
//           corner's place relative to the eye, of the ray's direction, of the shear;
//   beyond  how far a rounded edge function lets a ray pass an edge that is short beside the others:
//           it errs by 2^-22 of the square of the longest, over the edge's length; the test's box ends
//           that after a few lengths of the edge.
// The t of a hit is a mean of its corners' depths, though with weights that are off by as much
// as the edge functions are. So it cannot be less than that of `depth`.

uniform vec3 eye;
uniform vec3 right;      // scaled as Camera.basis scales them
uniform vec3 up;
uniform vec3 forward;
uniform vec2 size;
uniform float nearest;   // depth, along forward
uniform float farthest;  // no corner is as deep

const float PROPER = 9.5367e-7;         // 2^-20, sixteen roundings
const float BASE_MARGIN = 0.0625;       // pixels: more than rasterisers snap corners by

struct Cover {
    bool outside;     // no ray of the image hits it
    bool unbounded;   // it comes too near the eye: nothing is known of it
    vec2 a;           // its corners, in pixels
    vec2 b;
    vec2 c;
    float eta;        // pixels, as margin
    float margin;
    float depth;      // along forward
};

float length_squared(vec2 v) {
    return dot(v, v);
}

vec3 seen_from_eye(vec3 corner) {
    vec3 q = corner - eye;
    return vec3(dot(q, right) / dot(right, right), -dot(q, up) / dot(up, up), dot(q, forward));
}

vec4 clip_place(vec3 corner) {
    vec3 p = seen_from_eye(corner);
    float range = farthest - nearest;
    return vec4(p.xy, ((farthest + nearest) * p.z - 2.0 * farthest * nearest) / range, p.z);
}

// Times depth, how long the ray through a pixel's centre is.
float slant(vec2 centre) {
    vec2 at = 2.0 * centre / size - 1.0;
    return sqrt(1.0 + at.x * at.x * dot(right, right) + at.y * at.y * dot(up, up));
}

bool all_past(float a, float b, float c) {
    return min(min(a, b), c) > 0.0;
}

Cover cover_of(vec3 v0, vec3 v1, vec3 v2) {
    Cover cover;
    vec3 p = seen_from_eye(v0);
    vec3 q = seen_from_eye(v1);
    vec3 r = seen_from_eye(v2);
    vec3 far = vec3(distance(v0, eye), distance(v1, eye), distance(v2, eye));
    float farthest_corner = max(max(far.x, far.y), far.z);
    float axes = max(1.0, max(inversesqrt(dot(right, right)), inversesqrt(dot(up, up))));
    vec3 slack = 4.0 * PROPER * axes * far;
    cover.outside =
        all_past(p.x - p.z - slack.x, q.x - q.z - slack.y, r.x - r.z - slack.z)
        || all_past(-p.x - p.z - slack.x, -q.x - q.z - slack.y, -r.x - r.z - slack.z)
        || all_past(p.y - p.z - slack.x, q.y - q.z - slack.y, r.y - r.z - slack.z)
        || all_past(-p.y - p.z - slack.x, -q.y - q.z - slack.y, -r.y - r.z - slack.z)
        || all_past(-p.z - slack.x, -q.z - slack.y, -r.z - slack.z);
    float lowest = min(min(p.z, q.z), r.z);
    float ratio = max(max(p.z, q.z), r.z) / lowest;
    cover.unbounded = !(lowest >= nearest && farthest_corner < farthest);

    cover.a = (p.xy / p.z * 0.5 + 0.5) * size;
    cover.b = (q.xy / q.z * 0.5 + 0.5) * size;
    cover.c = (r.xy / r.z * 0.5 + 0.5) * size;
    float focal = 0.5 * max(size.x * inversesqrt(dot(right, right)), size.y * inversesqrt(dot(up, up)));
    float angle = farthest_corner / lowest;
    float across = 1.0 + dot(right, right) + dot(up, up);
    cover.eta = PROPER * (focal * (angle * angle + across) + max(size.x, size.y));
    float ab = distance(cover.a, cover.b);
    float bc = distance(cover.b, cover.c);
    float ca = distance(cover.c, cover.a);
    float longest = max(max(ab, bc), ca) + 2.0 * cover.eta;
    float shortest = min(min(ab, bc), ca);
    float grazing = ratio * ratio;
    float beyond = min(2.0 * PROPER * longest * longest * grazing / max(shortest - 2.0 * cover.eta, 1e-9),
                       8.0 * ratio * (shortest + 2.0 * cover.eta));
    cover.margin = BASE_MARGIN + 2.0 * cover.eta + beyond;

    float extent = max(max(distance(v0, v1), distance(v1, v2)), distance(v2, v0));
    float area = abs((cover.b.x - cover.a.x) * (cover.c.y - cover.a.y)
                     - (cover.b.y - cover.a.y) * (cover.c.x - cover.a.x)) - 4.0 * cover.eta * longest;
    float misjudged = min(6.0, 2.0 * PROPER * longest * longest * grazing / max(area, 1e-9));
    cover.depth = lowest - misjudged * extent - 4.0 * PROPER * farthest_corner;
    return cover;
}

// The pixels, x0 y0 x1 y1 with both ends, whose centres lie in the box around it.
ivec4 covered_pixels(Cover cover) {
    vec2 lo = min(min(cover.a, cover.b), cover.c) - cover.margin;
    vec2 hi = max(max(cover.a, cover.b), cover.c) + cover.margin;
    return ivec4(max(ceil(lo - 0.5), 0.0), min(floor(hi - 0.5), size - 1.0));
}
