"""Error bounds of the watertight triangle test in ``glsl/core/watertight.glsl``.

The bounds are computed for each pair of a ray and a triangle.

The analysis uses Higham's standard model ("Accuracy and Stability of Numerical Algorithms", 2002,
chapter 3), as pbrt does. Each operation returns ``x (1 + r)`` with ``|r| <= u`` (``unit`` below),
plus an error of at most ``tiny`` where the result underflows: renderers may flush denormals to
zero. A product of n factors ``1 + r`` is within ``gamma(n) = n u / (1 - n u)`` of 1. Division is
assumed to be correctly rounded. Contraction to fused multiply-adds only removes roundings. The
factor ``_ROUND_UP`` covers the errors of the bounds themselves, which are evaluated in float64.

A capital letter denotes a computed value, the lower case letter its exact value. The exact inputs
are the ray's origin O and direction d, and a vertex V. Axes are permuted so that the direction is
largest in z:

1. The host scales the direction by a power of two so that ``|d.z|`` is in [0.5, 1): exact.
2. ``A = V - O``: ``|A - a| <= u |a| + 3 tiny`` (two inputs and a result may be flushed).
3. ``S = d.x / d.z`` with ``|s| <= 1``: ``|S - s| <= u |s| + 4 tiny`` (1 / |d.z| is at most 2).
4. The sheared vertex ``P = A.x - S A.z``. The product ``S A.z`` contains the roundings of S and
   A.z and its own rounding, and the subtraction adds a fourth rounding:
   ``|P - p| <= (1 + u) (u |a.x| + gamma(3) |s a.z| + 8 tiny (1 + |a.z|)) + u |p| + tiny``.
5. The edge function ``W = P.x Q.y - P.y Q.x``. The sheared vertices P and Q have errors e and f,
   which change the first product by at most ``e.x |q.y| + |p.x| f.y + e.x f.y``. The second
   product changes similarly, and ``spread`` is the sum of both changes. The two products and the
   subtraction are rounded: ``|W - w| <= (1 + u) ((1 + u) spread + u (|p.x q.y| + |p.y q.x|) + 2
   tiny) + u |w| + tiny``.
6. ``DET = W0 + W1 + W2``: its error is at most ``(1 + u)^2`` times the sum of the three errors,
   plus ``gamma(2) sum |w|``.
7. The distance t of the plane. The test uses two edges E and F that meet in a vertex V, and
   their cross product N. For the axes i, j, k, let ``m_i = |e_j f_k| + |e_k f_j|``; then ``|N_i -
   n_i| <= gamma(4) m_i``.
   The dot product ``D = d . N`` adds gamma(3). The test multiplies N by 1 / D and takes the dot
   product with ``A = V - O``. The roundings of A, 1 / D, this product and the dot product add
   gamma(6). Since ``(a - t d) . n = 0``, ``T - t = ((a - t d) . (N - n) - t (D - d . N)) /
   D`` plus the last roundings. So the error of N is multiplied only by the hit's distance to V:
   ``|T - t| <= (gamma(4) sum |a_i - t d_i| m_i + gamma(3) |t| sum |d_i N_i| + gamma(6) sum
   |a_i N_i|) / |D|``. The test uses the two shorter edges. Where rounding may decide which edge
   is the longest, the largest bound of the possible choices is used. Underflow adds the terms with
   ``tiny`` in `_plane_bound`.
8. A second bound on t. The test clamps T to the range of the corners' distances ``Z_i / d.z``.
   These distances have the error gamma(3). So the error of T is at most the distance from t to the
   farther end of the range, plus this rounding. The smaller bound of steps 7 and 8 is used. If the
   exact t lies outside the exact range, both bounds refer to the nearer end of the range instead.
9. ``U = W1 / DET``. Here u is the exact coordinate, and ``W1 - u DET = (W1 - w1) - u (DET -
   det)``. The roundings of DET's inverse and of the product add gamma(3).

``glsl/core/slack.glsl`` explains how accelerators widen their boxes.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .plane import CROSS, edges_of, plane_distance, shorter

# This factor covers the rounding errors of the bounds, which are computed in float64.
_ROUND_UP = 1 + 2.0 ** -20


@dataclass(frozen=True)
class Arithmetic:
    """A binary floating-point format.

    Attributes
    ----------
    unit : largest relative error of an operation, 2^-p for p bits of significand
    tiny : smallest normal number, which bounds the error of flushing a denormal
    huge : values below this do not overflow
    """

    unit: float
    tiny: float
    huge: float


FLOAT32 = Arithmetic(2.0 ** -24, 2.0 ** -126, 2.0 ** 127)
FLOAT64 = Arithmetic(2.0 ** -53, 2.0 ** -1022, 2.0 ** 1023)


def gamma(n: int, unit: float = FLOAT32.unit) -> float:
    """Return ``n u / (1 - n u)``, the bound on the relative error of n consecutive roundings."""
    return n * unit / (1 - n * unit)


@dataclass
class PairBounds:
    """Hits and error bounds of k pairs of ray and triangle.

    Attributes
    ----------
    t : (k,) float64, the distance of the triangle's plane along the ray, in units of the
        direction's length, clamped to the range of the vertices' distances
    u, v : (k,) float64, barycentric coordinates of the point where the ray meets the plane
    t_bound, u_bound, v_bound : (k,) float64, bounds on the error of the test's t, u and v where
        the test accepts; t_bound is inf where an overflow is possible
    inside : (k,) bool, whether the ray certainly meets the triangle, so that the test must accept
    possible : (k,) bool, whether the test may accept; the interval of t is not considered. If
        false, the ray certainly misses the triangle, and the test must reject
    """

    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    t_bound: np.ndarray
    u_bound: np.ndarray
    v_bound: np.ndarray
    inside: np.ndarray
    possible: np.ndarray


def bound_pairs(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray,
                arithmetic: Arithmetic = FLOAT32) -> PairBounds:
    """Intersect k pairs of ray and triangle in float64, and bound the errors of the test.

    Triangles without area are not detected. For such a triangle, the test may accept or reject,
    whatever ``inside`` and ``possible`` say.

    Parameters
    ----------
    triangles : (k, 3, 3), float32 values, world units
    origins, directions : (k, 3), finite float32 values; no direction is zero
    arithmetic : FLOAT32 bounds the GLSL test, FLOAT64 the test of ``reference.trace``
    """
    unit, tiny = arithmetic.unit, arithmetic.tiny

    def g(n: int) -> float:
        return gamma(n, unit)

    exponent, vertices, corners, direction = _permuted(triangles, origins, directions)
    with np.errstate(all="ignore"):     # values that overflow or divide by zero are replaced below
        # Steps 2 to 4: (3 corners, 2 axes, k).
        shear, inv_z = direction[:2] / direction[2], 1 / direction[2]
        z = corners[:, 2]
        lean = shear * z[:, None]
        p = corners[:, :2] - lean
        p_bound = ((1 + unit) * (unit * np.abs(corners[:, :2]) + g(3) * np.abs(lean)
                                 + 8 * tiny * (1 + np.abs(z[:, None])))
                   + unit * np.abs(p) + tiny)
        # Step 5, for the edges opposite to v0, v1 and v2: (3, k).
        first, second = np.array((2, 0, 1)), np.array((1, 2, 0))
        w, w_bound = _edges(p[first], p_bound[first], p[second], p_bound[second], arithmetic)
        w_bound *= _ROUND_UP
        # Step 6.
        det = w[0] + w[1] + w[2]
        w_sum, w_most = np.abs(w).sum(axis=0), np.abs(w) + w_bound
        det_bound = ((1 + unit) ** 2 * w_bound.sum(axis=0) + g(2) * w_sum + 2 * tiny) * _ROUND_UP
        det_least = np.maximum(np.abs(det) - det_bound, 0)
        # Step 7.
        edges = edges_of(vertices)
        size = np.abs(edges).max(axis=1)
        forward = np.zeros(len(exponent))
        for k in range(3):
            bound = _plane_bound(corners[k], *shorter(edges, k), direction, arithmetic)
            may = size[k] >= (1 - g(3)) * size.max(axis=0) - 8 * tiny
            forward = np.maximum(forward, np.where(may & ~(bound >= 0), np.inf,
                                                   np.where(may, bound, 0)))
        # Step 8.
        plane = plane_distance(vertices, corners, direction)
        ends = z * inv_z
        lo, hi = ends.min(axis=0), ends.max(axis=0)
        rounding = g(3) * np.abs(ends).max(axis=0) + 8 * tiny * (1 + np.abs(z).max(axis=0))
        t = np.clip(np.where(np.isfinite(plane), plane, (lo + hi) / 2), lo, hi)
        convex = np.maximum(hi - t, t - lo) + rounding
        forward += np.where(plane == t, 0, rounding)
        t_bound = np.fmin(forward, convex) * _ROUND_UP
        # Step 9.
        u, u_bound = _weight(1, w, w_bound, w_most, det, det_least, arithmetic)
        v, v_bound = _weight(2, w, w_bound, w_most, det, det_least, arithmetic)

        # Products of two sheared coordinates, and depths divided by d.z, must not overflow: they
        # are the test's largest values.
        spread = np.abs(p).max(axis=(0, 1)) + p_bound.max(axis=(0, 1))
        most = np.maximum(spread ** 2, np.abs(z).max(axis=0))
        safe = (most < arithmetic.huge / 8) & (w_most.sum(axis=0) < arithmetic.huge / 8)
        above, below = w > w_bound, w < -w_bound
        inside = (above.all(axis=0) | below.all(axis=0)) & safe & (det_least > 4 * tiny)
        in_box = (((p - p_bound).min(axis=0) <= 0) & ((p + p_bound).max(axis=0) >= 0)).all(axis=0)
        possible = ~(above.any(axis=0) & below.any(axis=0)) & in_box | ~safe
        t_bound[~safe] = np.inf
        # Undo the scaling of the direction; t is rounded once more if it becomes denormal.
        t = np.ldexp(t, -exponent)
        t_bound = np.ldexp(t_bound, -exponent) + 2.0 ** -149
    return PairBounds(t, u, v, t_bound, u_bound, v_bound, inside, possible)


def distance_bound(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray,
                   arithmetic: Arithmetic = FLOAT32) -> np.ndarray:
    """Return the ``t_bound`` of `bound_pairs`, (k,) float64."""
    return bound_pairs(triangles, origins, directions, arithmetic).t_bound


def _permuted(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray
              ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Do steps 1 and 2: return exponents (k,), vertices (3, 3, k), vertices relative to the origin
    (3, 3, k) and scaled directions (3, k)."""
    origins, directions = (np.asarray(a, np.float64) for a in (origins, directions))
    size = np.abs(directions)
    exponent = np.frexp(size.max(axis=1, initial=0))[1]
    order = (size.argmax(axis=1)[:, None] + (1, 2, 3)) % 3
    direction = np.ldexp(np.take_along_axis(directions, order, 1), -exponent[:, None]).T
    origin = np.take_along_axis(origins, order, 1)
    corners = np.take_along_axis(np.asarray(triangles, np.float64), order[:, None], 2)
    vertices = np.ascontiguousarray(corners.transpose(1, 2, 0))
    return exponent, vertices, vertices - origin.T, np.ascontiguousarray(direction)


def _edges(p: np.ndarray, e: np.ndarray, q: np.ndarray, f: np.ndarray, arithmetic: Arithmetic
           ) -> tuple[np.ndarray, np.ndarray]:
    """Do step 5 for vertices p and q (3, 2, k) with errors e and f: return w and bounds, (3, k).

    The computed |p| and |q| may be too small by e and f. This adds two products e f to the product
    e f of step 5.
    """
    unit, tiny = arithmetic.unit, arithmetic.tiny
    one, two = p[:, 0] * q[:, 1], p[:, 1] * q[:, 0]
    spread = np.zeros_like(one)
    for x, y in ((0, 1), (1, 0)):
        spread += (e[:, x] * np.abs(q[:, y]) + np.abs(p[:, x]) * f[:, y]
                   + 3 * e[:, x] * f[:, y])
    w = one - two
    bound = ((1 + unit) * ((1 + unit) * spread + unit * (np.abs(one) + np.abs(two)) + 2 * tiny)
             + unit * np.abs(w) + tiny)
    return w, bound


def _plane_bound(corner: np.ndarray, e: np.ndarray, f: np.ndarray, direction: np.ndarray,
                 arithmetic: Arithmetic) -> np.ndarray:
    """Do step 7 for the edges e and f that meet in the corner, (3, k) each: return bounds, (k,). A
    bound is inf or not a number where the denominator may be 0 or a product may overflow."""
    unit, tiny = arithmetic.unit, arithmetic.tiny
    m = np.abs([e[i] * f[j] for i, j in CROSS]) + np.abs([e[j] * f[i] for i, j in CROSS])
    n = np.array([e[i] * f[j] - e[j] * f[i] for i, j in CROSS])
    # Underflow may change an edge by 3 tiny. A component of the normal takes three operations, and
    # underflow may change the result of each operation by 1 tiny.
    n_bound = gamma(4, unit) * m + tiny * (4 + 8 * (np.abs(e) + np.abs(f)).sum(axis=0))
    n_most, d = np.abs(n) + n_bound, np.abs(direction)
    exact = (direction * n).sum(axis=0)
    sums = gamma(3, unit) * (d * n_most).sum(axis=0) + tiny * (8 + n_most.sum(axis=0))
    least = np.abs(exact) - (d * n_bound).sum(axis=0) - sums
    t = (corner * n).sum(axis=0) / exact
    beside = np.abs(corner - t * direction)
    a_most = (np.abs(corner) * n_most).sum(axis=0)
    bound = ((beside * n_bound).sum(axis=0) + np.abs(t) * sums + gamma(6, unit) * a_most
             + tiny * (3 * n_most.sum(axis=0) + (8 + np.abs(corner).sum(axis=0)) * least)) / least
    return np.where((least > 4 * tiny) & (m.max(axis=0) < arithmetic.huge / 8), bound, np.inf)


def _weight(i: int, w: np.ndarray, w_bound: np.ndarray, w_most: np.ndarray, det: np.ndarray,
            det_least: np.ndarray, arithmetic: Arithmetic) -> tuple[np.ndarray, np.ndarray]:
    """Do step 9: return a barycentric coordinate, (k,), and its error bound.

    An accepted coordinate lies in [0, 1], so its error is at most the distance of the exact
    coordinate from the farther end.
    """
    unit, tiny = arithmetic.unit, arithmetic.tiny
    weight = w[i] / det
    size = np.abs(weight)
    others = w_bound.sum(axis=0) - w_bound[i]
    forward = (w_bound[i] * np.abs(1 - weight) + size * (others + gamma(2, unit)
               * w_most.sum(axis=0) + 2 * tiny) + tiny) / det_least
    forward = forward + gamma(3, unit) * (size + forward)
    weight = np.where(np.isfinite(weight), weight, 0.5)
    convex = np.maximum(np.abs(weight), np.abs(1 - weight)) + gamma(5, unit)
    return weight, np.fmin(forward, convex) * _ROUND_UP
