// Boxes are widened so that rounding never loses a box that contains a hit. Instead of moving the boxes,
// the setup of a ray (core/ray.glsl) shifts the origins from which the ray measures their corners.
//
// Let u be the unit roundoff ARITHMETIC_UNIT, and M the largest distance along any axis from the ray's
// origin to a point of the scene. A distance along one axis does not bound the error along this axis,
// because the watertight test shears depth onto the other two axes. For example, if the scene and the
// origin lie in the plane y = 0, a sheared corner is off by several u M along y. To first order in u, these
// errors arise along an axis (as in gpgpu_rt/numerics/error_bounds.py):
//
//   6 u M             A sheared corner: u M from the subtraction, 3 u M from the product, 2 u M from the
//                     sum. Edge functions have the right signs for the computed corners. So an
//                     accepted ray misses the exact triangle by at most this distance.
//   (14 + 16 k) u M/c The hit's place: 14 u M from the two dot products and the quotient, 16 k u M from
//                     the normal. The number c is the cosine of the angle between ray and normal. The
//                     number k is the product of the lengths of the two shorter edges, divided by the
//                     length of their cross product.
//   5 u M             A slab's t: the roundings of M, a difference, the inverse direction and a product.
//
// The sum, 11 u M + (14 + 16 k) u M / c, is below BOX_SLACK M if (14 + 16 k) / c is below 53. If a triangle
// lies in a plane perpendicular to an axis, its normal has a single component. Then k = c = 1 in the bound.
// Oblique needles have a larger k. Oblique planes almost parallel to the ray have a smaller c. The t of a
// hit there may lie outside the ray's interval of t in the box. A search that begins or ends between this t
// and the interval loses the hit (docs/extremes.md says how often).
//
// The slack also includes SPACING times each coordinate of the origin. This term is at least the distance
// to the next float. Without the term, the sum of origin and slack could round back to the origin in a
// scene far from 0.

uniform vec3 scene_lo;
uniform vec3 scene_hi;

const float BOX_SLACK = 64.0 * ARITHMETIC_UNIT;   // 3.8e-6 in float32
const float SPACING = 2.0 * ARITHMETIC_UNIT;      // largest relative distance of neighbouring floats

vec3 box_slack(vec3 origin) {
    vec3 reach = R(max(abs(scene_lo - origin), abs(scene_hi - origin)));
    return R(R(BOX_SLACK * largest(reach)) + SPACING * abs(origin));
}
