// Computes the pixels whose eye rays can hit a triangle, and the least depth of the hits. These bounds
// serve to check the rasteriser's first hits. Each value is moved to the safe side by a bound on its error:
// sixteen times the first-order terms of the error.
//
// Let all corners of a triangle be at least `nearest` deep. If `test_triangle` accepts the triangle for the
// ray through a pixel's centre, the projected triangle is at most `margin` pixels from this centre. Two
// errors make the margin:
//   `eta` bounds the error of a projected corner, both here and in the test. It covers the rounding of the
//   corner's position relative to the eye, of the ray's direction, and of the shear.
//   `beyond` bounds how far outside an edge of length l an accepted ray may pass. The rounding of the edge
//   function allows 2^-19 (m `ratio`)^2 / l. Here m is the longest edge, and `ratio` is the greatest depth
//   of a corner divided by the least. A short edge would get a large bound. But beyond a short edge, the
//   other two edges and the triangle's bounding box enclose a small area, so 8 l `ratio` is a bound, too.
// A triangle is `cut` if a corner is less than `nearest` deep. Such a corner has no exact position in the
// image, so first_rivals.frag replaces the edges of a cut triangle by planes through the eye. There, the
// bound on the rounding of `test_triangle` grows with the square of `reach`, because this test multiplies
// coordinates of two corners.
//
// The test clamps a hit's depth to the range of the corners' depths. So the least depth of a corner, minus
// an error, is a lower bound: the field `depth`. The exact depth of the triangle's plane is 1 / (`slope` .
// ray); `slope_off` covers the errors of the normal here and in the test. A hit may be less deep than the
// plane, because of rounding and clamping, but by at most `misjudged`.

uniform vec3 eye;
uniform vec3 right;      // `right` and `up` are scaled as in Camera.basis
uniform vec3 up;
uniform vec3 forward;
uniform vec2 size;
uniform float nearest;   // depth, along forward
uniform float farthest;  // a depth beyond all corners

const float ERROR = 9.5367e-7;     // 2^-20: sixteen roundings
const float BEHIND_ALL = -1e30;    // a depth that excludes nothing

struct Cover {
    bool outside;     // whether no ray of the image hits the triangle
    bool cut;         // whether a corner is less deep than `nearest`
    vec3 place_0;     // the corners seen from the eye: x / z and y / z lie in [-1, 1] in the image
    vec3 place_1;
    vec3 place_2;
    vec2 a;           // the projected corners, pixels
    vec2 b;
    vec2 c;
    float eta;        // in pixels; so are `beyond` and `margin`
    vec3 beyond;      // for the edges that begin at a, b and c
    float margin;
    float depth;      // along forward; so is `misjudged`
    float misjudged;
    vec3 slope;       // 1 / depth = slope . (x, y, 1), x and y in [-1, 1]; error at most slope_off
    float slope_off;
    float reach;      // the distance of the farthest corner from the eye, world units
};

vec3 seen_from_eye(vec3 corner) {
    vec3 q = corner - eye;
    return vec3(dot(q, right) / dot(right, right), -dot(q, up) / dot(up, up), dot(q, forward));
}

vec4 clip_place(vec3 corner) {
    vec3 p = seen_from_eye(corner);
    float range = farthest - nearest;
    return vec4(p.xy, ((farthest + nearest) * p.z - 2.0 * farthest * nearest) / range, p.z);
}

// The length of the ray through a pixel's centre, per unit of depth.
float slant(vec2 centre) {
    vec2 at = 2.0 * centre / size - 1.0;
    return sqrt(1.0 + at.x * at.x * dot(right, right) + at.y * at.y * dot(up, up));
}

float least(vec3 v) {
    return min(min(v.x, v.y), v.z);
}

float greatest(vec3 v) {
    return max(max(v.x, v.y), v.z);
}

Cover cover_of(vec3 v0, vec3 v1, vec3 v2) {
    Cover cover;
    vec3 p = seen_from_eye(v0);
    vec3 q = seen_from_eye(v1);
    vec3 r = seen_from_eye(v2);
    cover.place_0 = p;
    cover.place_1 = q;
    cover.place_2 = r;
    vec3 away = vec3(distance(v0, eye), distance(v1, eye), distance(v2, eye));
    cover.reach = greatest(away);
    float axis = max(1.0, max(inversesqrt(dot(right, right)), inversesqrt(dot(up, up))));
    vec3 slack = 4.0 * ERROR * axis * away;
    vec3 x = vec3(p.x, q.x, r.x);
    vec3 y = vec3(p.y, q.y, r.y);
    vec3 z = vec3(p.z, q.z, r.z);
    cover.outside = least(x - z - slack) > 0.0 || least(-x - z - slack) > 0.0
        || least(y - z - slack) > 0.0 || least(-y - z - slack) > 0.0 || least(-z - slack) > 0.0;
    float lowest = least(z);
    cover.cut = !(lowest >= nearest);
    lowest = cover.cut ? nearest : lowest;
    float ratio = greatest(z) / lowest;
    float angle = cover.reach / lowest;
    float across = 1.0 + dot(right, right) + dot(up, up);
    float focal = 0.5 * max(size.x * inversesqrt(dot(right, right)), size.y * inversesqrt(dot(up, up)));

    cover.a = (p.xy / p.z * 0.5 + 0.5) * size;
    cover.b = (q.xy / q.z * 0.5 + 0.5) * size;
    cover.c = (r.xy / r.z * 0.5 + 0.5) * size;
    cover.eta = ERROR * (focal * (angle * angle + across) + max(size.x, size.y));
    vec3 sides = vec3(distance(cover.a, cover.b), distance(cover.b, cover.c), distance(cover.c, cover.a));
    float longest = greatest(sides) + 2.0 * cover.eta;
    float square = 2.0 * ERROR * longest * longest * ratio * ratio;
    cover.beyond = min(square / max(sides - 2.0 * cover.eta, 1e-9),
                       8.0 * ratio * (sides + 2.0 * cover.eta));
    cover.margin = 2.0 * cover.eta + greatest(cover.beyond);

    vec3 from = v1 - v0;
    vec3 to = v2 - v0;
    vec3 normal = cross(from, to);
    float height = dot(normal, v0 - eye);
    float extent = max(distance(v1, v2), max(length(from), length(to)));
    vec2 ab = cover.b - cover.a;
    vec2 ac = cover.c - cover.a;
    float area = abs(ab.x * ac.y - ab.y * ac.x) - 4.0 * cover.eta * longest;
    cover.misjudged = extent * min(6.0, square / max(area, 1e-9)) + 4.0 * ERROR * cover.reach;
    cover.depth = lowest - cover.misjudged;
    cover.slope = vec3(dot(normal, right), -dot(normal, up), dot(normal, forward)) / height;
    cover.slope_off = (8.0 * ERROR * length(from) * length(to) * angle * across
                       + cover.margin / focal * length(normal)) / abs(height);
    if (cover.cut) {
        // The error of the hit's depth is the error of the normal times the distance from the hit to a
        // corner, plus the rounding of the dot products. Both parts are below `relative` times the depth.
        // Dividing `slope` by 1 - `relative` covers this error.
        float relative = 8.0 * ERROR * cover.reach * cover.reach * across * extent / abs(height);
        cover.misjudged = 4.0 * ERROR * cover.reach;
        cover.depth = BEHIND_ALL;
        cover.slope_off = 8.0 * ERROR * length(from) * length(to) * across / abs(height);
        cover.slope /= 1.0 - relative;
        cover.slope_off = relative < 0.5 ? cover.slope_off / (1.0 - relative) : 1e30;
    }
    if (!(cover.slope_off < 1e30)) {     // the triangle is seen edge-on, or nearly so
        cover.slope = vec3(0.0);
        cover.slope_off = 1e30;
    }
    return cover;
}

// The least depth at which a ray can hit the triangle, for a square of pixels with this centre. `around` is
// half the square's diagonal.
float least_depth(Cover cover, vec2 centre, float around) {
    vec2 at = 2.0 * centre / size - 1.0;
    float inverse = dot(cover.slope, vec3(at, 1.0)) + cover.slope_off
        + 2.0 * around * length(cover.slope.xy / size);
    return max(cover.depth, inverse > 0.0 ? 1.0 / inverse - cover.misjudged : cover.depth);
}

// The pixels whose centres lie in the box around the triangle, widened by `margin`: x0, y0, x1, y1, both
// ends included. A cut triangle gets all pixels.
ivec4 covered_pixels(Cover cover) {
    if (cover.cut) {
        return ivec4(0, 0, ivec2(size) - 1);
    }
    vec2 lo = min(min(cover.a, cover.b), cover.c) - cover.margin;
    vec2 hi = max(max(cover.a, cover.b), cover.c) + cover.margin;
    return ivec4(max(ceil(lo - 0.5), 0.0), min(floor(hi - 0.5), size - 1.0));
}
