// Computes conservative bounds of a visible triangle: the tiles of an image through which rays may hit the
// triangle, and the depths of the hits. Depth is measured along `forward`. The ray through a pixel has the
// direction D = forward + x right - y up, with x and y in [-1, 1]. A point at depth z on this ray is eye +
// z D. Edges are tested as in Olano and Greer ("Triangle Scan Conversion using 2D Homogeneous Coordinates",
// Graphics Hardware 1997). No vertex is divided by its depth, so vertices may lie behind the eye.
//
// Rounding. Let W be the distance of the farthest vertex from the eye and u = 2^-24. The watertight test
// behaves like an exact test of a triangle whose vertices are displaced by a few u W. Subtracting the eye
// from a vertex and shearing the difference rounds by less than 8 u W. The rounding of an edge function's
// two products acts like a displacement of a vertex by u times the edge's length, which is at most 2 W. The
// test's t is the distance of the plane, clamped to the range of the vertices' depths. Rounding rotates the
// plane's normal slightly. The products in this file have errors of the same size. MARGIN is 100 u: all
// lengths are widened by MARGIN times W. Displacements of the vertices by MARGIN times W rotate the normal
// more than rounding does, so their rotation is the bound on the normal's error.

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
