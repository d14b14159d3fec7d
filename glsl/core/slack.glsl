// Boxes are widened so that rounding never loses a box that contains a hit. The boxes themselves do not
// change: each ray moves, once, the origins from which the ray measures the corners of boxes.
//
// Let u be the unit roundoff ARITHMETIC_UNIT, and M the largest distance from the origin to a point of the
// scene along any axis. A distance along one axis does not bound the error along this axis, because the
// watertight test shears depth onto the other two axes. For example, let the scene and the origin lie in
// the plane y = 0: their distance along y is 0, yet the test's t is off by several u M. These errors arise
// along an axis, to first order in u (gpgpu_rt/numerics/error_bounds.py has the same steps):
//
//   6 u M             A sheared corner: u M by the subtraction, 3 u M by the product, 2 u M by the
//                     sum. Edge functions have the right signs for the corners as computed. An
//                     accepted ray therefore passes the triangle at most this far away.
//   2 u M (6 k + 1)   The hit's place. t is a mean of the corners' depths, weighted by the edge
//                     functions. Let X and Y, at most 2 M, be the largest |x| and |y| of the sheared
//                     corners, and X Y / k the sum of the weights. The error of a weight is 2 u X Y
//                     plus u times the weight.
//   7 u M             t: weights, sums, 1 / determinant, 1 / direction.
//   5 u M             The slab's t: M itself, a difference, the inverse direction, a product.
//
// The sum, 20 u M + 12 k u M, is below BOX_SLACK M for k up to 3.6. A triangle that fills half of its
// sheared box has k <= 1. In a plane perpendicular to an axis, k depends only on the triangle's shape, even
// if the ray is almost parallel to the plane. The shear then scales X, Y and the sum of the weights alike.
// Oblique needles, and oblique planes almost parallel to the ray, have a larger k: their t may lie outside
// their box. The search loses such a hit if the search begins or ends between t and the box;
// docs/extremes.md says how often.
//
// The slack also includes SPACING times the origin, which is at least half the distance from the origin to
// the next float. Without this term the sum of origin and slack could round back to the origin in a scene
// far from 0, and no box would be widened.

uniform vec3 scene_lo;
uniform vec3 scene_hi;

const float BOX_SLACK = 64.0 * ARITHMETIC_UNIT;   // 3.8e-6 in float32
const float SPACING = 2.0 * ARITHMETIC_UNIT;      // largest relative distance of neighbouring floats

vec3 box_slack(vec3 origin) {
    vec3 reach = R(max(abs(scene_lo - origin), abs(scene_hi - origin)));
    float most = max(max(reach.x, reach.y), reach.z);
    return R(R(BOX_SLACK * most) + SPACING * abs(origin));
}
