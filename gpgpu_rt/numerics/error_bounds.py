"""How far the watertight triangle test of ``glsl/core/triangle.glsl`` may be off, pair by pair.

The analysis is Higham's standard model ("Accuracy and Stability of Numerical Algorithms", 2002,
chapter 3), as pbrt uses it: each operation returns ``x (1 + d)`` with ``|d| <= u``, plus at most
``tiny`` where the result underflows (renderers may flush denormals, their inputs' too), and n such
factors in a row are within ``gamma(n) = n u / (1 - n u)`` of 1. Division counts as correctly
rounded, and contraction to fused multiply-adds only leaves roundings out. Everything here is
evaluated in float64, whose own error has the same form with u = 2^-53: ``_ROUND_UP`` covers it.

The steps, each of which leans on the one before; a capital letter is what the test computes, its
lower case the exact value, in axes permuted so that z is the direction's largest component:

1. The host scales the direction by a power of two until ``|d.z|`` is in [0.5, 1): exact.
2. ``A = V - O``: ``|A - a| <= u |a| + 3 tiny`` (two inputs and a result may be flushed).
3. ``S = d.x / d.z`` with ``|s| <= 1``: off by ``u |s| + 4 tiny`` (1 / |d.z| is at most 2).
4. The sheared vertex ``P = A.x - S A.z``. The product has three roundings: those of S, of A.z and
   its own; then comes that of the subtraction:
   ``|P - p| <= (1 + u) (u |a.x| + gamma(3) |s a.z| + 8 tiny (1 + |a.z|)) + u |p| + tiny``.
5. An edge function ``W = P.x Q.y - P.y Q.x``. With e and f the errors of P and Q, a product's
   factors put it off by ``e.x |q.y| + |p.x| f.y + e.x f.y``, and three roundings follow:
   ``|W - w| <= (1 + u) ((1 + u) spread + u (|p.x q.y| + |p.y q.x|) + 2 tiny) + u |w| + tiny``.
6. ``DET = W0 + W1 + W2``: ``(1 + u)^2`` times the sum of their errors, plus ``gamma(2) sum |w|``.
7. t. Let ``z`` be the depth where the ray meets the plane, so that ``sum w_i (z_i - z) = 0``. Then
   ``sum W_i Z_i - z DET = sum (W_i - w_i)(z_i - z) + sum W_i (Z_i - z_i)`` plus the roundings
   of the two sums, ``gamma(3) sum |W_i Z_i| + |z| gamma(2) sum |W_i|``: the error of an edge
   function moves t only by how far its vertex's depth is from the hit's. Divided by the least
   that DET can be, this is the error of the depth; ``1 / d.z``, ``1 / DET`` and their two
   products add gamma(4).
8. But where the test accepts, the W_i have one sign and T is a convex combination of the Z_i: its
   depth is off by no more than the vertex furthest from it along the ray, plus gamma(6) of the
   largest ``|Z_i|`` for the roundings of weights and sums. The smaller of 7 and 8 holds. Where
   the plane is met outside the vertices' depths, z is moved to the nearest of them; T can only be
   nearer to that.
9. ``U = W1 / DET``: as in 7, ``W1 - u DET = (W1 - w1) - u (DET - det)``, and gamma(3) for the
   roundings of DET's inverse and the product.

How accelerators widen their boxes is another matter: see ``glsl/core/slack.glsl``.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Rounds a bound up by more than its own evaluation in float64 can be off.
_ROUND_UP = 1 + 2.0 ** -20


@dataclass(frozen=True)
class Arithmetic:
    """A binary floating-point format.

    Attributes
    ----------
    unit : largest relative error of an operation, 2^-p for p bits of significand
    tiny : smallest normal number, what flushing a denormal loses at most
    huge : no value below this overflows
    """

    unit: float
    tiny: float
    huge: float


FLOAT32 = Arithmetic(2.0 ** -24, 2.0 ** -126, 2.0 ** 127)
FLOAT64 = Arithmetic(2.0 ** -53, 2.0 ** -1022, 2.0 ** 1023)


def gamma(n: int, unit: float = FLOAT32.unit) -> float:
    """The bound ``n u / (1 - n u)`` on what n roundings in a row amount to."""
    return n * unit / (1 - n * unit)


@dataclass
class PairBounds:
    """What is known of k pairs of ray and triangle.

    Attributes
    ----------
    t : (k,) float64, where the ray meets the triangle's plane, in units of the direction's length,
        moved into the interval of the vertices' depths where the plane is met outside it
    u, v : (k,) float64, barycentrics of that point of the plane
    t_bound, u_bound, v_bound : (k,) float64, how far the test's t, u and v are off at most, where
        it accepts; inf where something may overflow
    inside : (k,) bool, the ray certainly meets the triangle: the test must accept it
    possible : (k,) bool, the test may accept it, whatever t; where false the ray certainly misses
        the triangle, and the test must say so
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
    """Decide k pairs of ray and triangle in float64, and bound what an arithmetic makes of them.

    Triangles without area are not looked for: the test may or may not accept them.

    Parameters
    ----------
    triangles : (k, 3, 3), world units, of float32 values
    origins, directions : (k, 3), of float32 values, finite, directions not zero
    arithmetic : FLOAT32 bounds the GLSL test, FLOAT64 that of ``reference.trace``
    """
    unit, tiny = arithmetic.unit, arithmetic.tiny

    def g(n: int) -> float:
        return gamma(n, unit)

    exponent, corners, direction = _permuted(triangles, origins, directions)
    with np.errstate(all="ignore"):     # what overflows or divides by zero is replaced below
        # Steps 2 to 4: (3 corners, 2 axes, k).
        shear, inv_z = direction[:2] / direction[2], 1 / direction[2]
        z = corners[:, 2]
        lean = shear * z[:, None]
        p = corners[:, :2] - lean
        p_bound = ((1 + unit) * (unit * np.abs(corners[:, :2]) + g(3) * np.abs(lean)
                                 + 8 * tiny * (1 + np.abs(z[:, None])))
                   + unit * np.abs(p) + tiny)
        # Step 5, for the edges opposite of v0, v1 and v2: (3, k).
        first, second = np.array((2, 0, 1)), np.array((1, 2, 0))
        w, w_bound = _edges(p[first], p_bound[first], p[second], p_bound[second], arithmetic)
        w_bound *= _ROUND_UP
        # Step 6.
        det = w[0] + w[1] + w[2]
        w_sum, w_most = np.abs(w).sum(axis=0), np.abs(w) + w_bound
        det_bound = ((1 + unit) ** 2 * w_bound.sum(axis=0) + g(2) * w_sum + 2 * tiny) * _ROUND_UP
        det_least = np.maximum(np.abs(det) - det_bound, 0)
        # Step 7.
        lo, hi, z_most = z.min(axis=0), z.max(axis=0), np.abs(z).max(axis=0)
        plane = (w * z).sum(axis=0) / det
        forward = ((w_bound * np.abs(z - plane)).sum(axis=0)
                   + (w_most * (unit * np.abs(z) + 3 * tiny)).sum(axis=0)
                   + g(3) * (w_most * np.abs(z)).sum(axis=0) * (1 + unit)
                   + np.abs(plane) * (g(2) * w_most.sum(axis=0) + 2 * tiny)
                   + 8 * tiny) / det_least
        # Step 8. A nonzero difference of two floats is no less than u of them: so a nonzero w is
        # no less than u of its products, those no less than u^2 of the vertices', save for
        # vertices nearer than that to the ray. This tells how much of N may underflow.
        depth = np.clip(np.where(np.isfinite(plane), plane, (lo + hi) / 2), lo, hi)
        spread = np.abs(p).max(axis=(0, 1)) + p_bound.max(axis=(0, 1))
        lost = 8 * tiny / np.maximum(det_least, unit ** 3 * spread ** 2)
        convex = np.maximum(hi - depth, depth - lo) + g(6) * z_most + lost
        # Outside the vertices' depths T is convex up to its roundings: they count besides.
        forward += np.where(plane == depth, 0, g(6) * z_most + lost)
        depth_bound = np.fmin(forward, convex)
        t_bound = ((depth_bound + g(4) * (np.abs(depth) + depth_bound)) * np.abs(inv_z)
                   + tiny) * _ROUND_UP
        # Step 9.
        u, u_bound = _weight(1, w, w_bound, w_most, det, det_least, arithmetic)
        v, v_bound = _weight(2, w, w_bound, w_most, det, det_least, arithmetic)

        # Products of an edge function and a depth are the largest values, DET's inverse the least.
        most = np.maximum(w_most.max(axis=0) * (1 + 4 * z_most), spread ** 2)
        safe = (most < arithmetic.huge / 8) & (w_most.sum(axis=0) < arithmetic.huge / 8)
        above, below = w > w_bound, w < -w_bound
        inside = (above.all(axis=0) | below.all(axis=0)) & safe & (det_least > 4 * tiny)
        in_box = (((p - p_bound).min(axis=0) <= 0) & ((p + p_bound).max(axis=0) >= 0)).all(axis=0)
        possible = ~(above.any(axis=0) & below.any(axis=0)) & in_box | ~safe
        t_bound[~safe] = np.inf
        # Back to the caller's direction; t is rounded once more if that makes it a denormal.
        t = np.ldexp(depth * inv_z, -exponent)
        t_bound = np.ldexp(t_bound, -exponent) + 2.0 ** -149
    return PairBounds(t, u, v, t_bound, u_bound, v_bound, inside, possible)


def distance_bound(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray,
                   arithmetic: Arithmetic = FLOAT32) -> np.ndarray:
    """(k,) float64, how far the test's t is off at most; parameters as in `bound_pairs`."""
    return bound_pairs(triangles, origins, directions, arithmetic).t_bound


def _permuted(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray
              ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Steps 1 and 2: exponents (k,), vertices seen from the origin (3, 3, k), direction (3, k)."""
    origins, directions = (np.asarray(a, np.float64) for a in (origins, directions))
    size = np.abs(directions)
    exponent = np.frexp(size.max(axis=1, initial=0))[1]
    order = (size.argmax(axis=1)[:, None] + (1, 2, 3)) % 3
    direction = np.ldexp(np.take_along_axis(directions, order, 1), -exponent[:, None]).T
    origin = np.take_along_axis(origins, order, 1)
    corners = np.take_along_axis(np.asarray(triangles, np.float64), order[:, None], 2)
    corners = np.ascontiguousarray((corners - origin[:, None]).transpose(1, 2, 0))
    return exponent, corners, np.ascontiguousarray(direction)


def _edges(p: np.ndarray, e: np.ndarray, q: np.ndarray, f: np.ndarray, arithmetic: Arithmetic
           ) -> tuple[np.ndarray, np.ndarray]:
    """Step 5 for vertices (3, 2, k) with their errors: edge functions (3, k) and their bounds.

    The square of the errors counts thrice: the magnitudes at hand may be off by them as well.
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


def _weight(i: int, w: np.ndarray, w_bound: np.ndarray, w_most: np.ndarray, det: np.ndarray,
            det_least: np.ndarray, arithmetic: Arithmetic) -> tuple[np.ndarray, np.ndarray]:
    """Step 9: a barycentric (k,) and its bound, no more than the distance to the far end of [0, 1]
    as the test keeps it there."""
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
