// A triangle as an eye sees it, conservatively: which tiles of an image it may be hit through, and
// how deep there. Depth is measured along `forward`; the ray through a pixel is
// D = forward + x right - y up, x and y in [-1, 1], so a point at depth z on it is eye + z D.
// Edges are tested as Olano and Greer do ("Triangle Scan Conversion using 2D Homogeneous
// Coordinates", Graphics Hardware 1997): no vertex is divided by its depth, so none need lie before
// the eye.
//
// Rounding. Let W be the length of the farthest vertex seen from the eye and u = 2^-24. The
// watertight test hits what a ray would hit exactly if vertices lay within a few u W of their
// places: each is rounded as it is moved to the eye and sheared (below 8 u W), the two products of an
// edge function as if the vertex were off by u of the edge, which is at most 2 W. Its t is a mean of
// vertices' depths whose weights have one sign. The products here err by as much. MARGIN is 100 u:
// all lengths are taken that much of W wider, and the normal as the vertices' shift turns it.

const float MARGIN = 6e-6;
const float FAR_AWAY = 3.0e38;

uniform vec3 eye;
uniform vec3 right;
uniform vec3 up;
uniform vec3 forward;
uniform vec2 image;     // pixels

vec3 eye_direction(vec2 pixel) {
    vec2 at = 2.0 * pixel / image - 1.0;
    return forward + at.x * right - at.y * up;
}

float farthest(vec3 a, vec3 b, vec3 c) {
    return max(max(length(a), length(b)), length(c));
}

vec3 depths(vec3 a, vec3 b, vec3 c) {
    return vec3(dot(a, forward), dot(b, forward), dot(c, forward));
}

float least(vec3 v) {
    return min(min(v.x, v.y), v.z);
}

float most(vec3 v) {
    return max(max(v.x, v.y), v.z);
}
