"""Exact hits: computes nearest hits with integers, for rays that float64 cannot decide.

Cramer's rule solves ``o + t d = (1 - u - v) v0 + u v1 + v v2``. Every float32 number is an integer
times a power of two, so Python's unlimited integers solve the equation exactly. Only the final t,
u and v are rounded, each to the nearest float64.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..hits import Hits
from ..numerics.public_call import public_call

_BITS = 24          # bits of a float32 significand
_PAIRS = 1 << 16    # largest number of pairs of ray and triangle in a batch


@dataclass
class ExactPairs:
    """Solutions of k pairs of ray and triangle: t as a fraction of integers, u and v rounded.

    Attributes
    ----------
    inside : (k,) bool, whether the ray's line meets the triangle. Edges and vertices are included;
        a line in the triangle's plane misses the triangle
    above, below : (k,) integers; t is ``above`` / ``below``; where ``inside``, ``below`` > 0
    u, v : (k,) float64, barycentric coordinates, correctly rounded; NaN where not ``inside``
    """

    inside: np.ndarray
    above: np.ndarray
    below: np.ndarray
    u: np.ndarray
    v: np.ndarray

    @property
    def t(self) -> np.ndarray:
        """(k,) float64, t correctly rounded; NaN where not ``inside``."""
        return _quotients(self.above, self.below, self.inside)

    def within(self, t_min: np.ndarray, t_max: np.ndarray) -> np.ndarray:
        """Return (k,) bool, whether each pair is a hit with t from ``t_min`` to ``t_max``."""
        hit = self.inside.copy()
        for end, sign in ((t_min, 1), (t_max, -1)):
            hit &= sign * np.where(np.isinf(end), end, 0) <= 0
            known = np.flatnonzero(hit & np.isfinite(end))
            (number,), exponent = _integers(end[known])
            above, below = self.above[known], self.below[known]
            if exponent < 0:
                above = above << -exponent
            else:
                number = number << exponent
            hit[known] = (sign * (above - number * below) >= 0).astype(bool)
        return hit


def solve_pairs(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> ExactPairs:
    """Intersect k pairs of ray and triangle exactly.

    Parameters
    ----------
    triangles : (k, 3, 3), of float32 values, world units
    origins, directions : (k, 3), of float32 values, finite
    """
    (corners, origin), position = _integers(triangles, origins)
    (direction,), heading = _integers(directions)
    v0, v1, v2 = (_columns(corners[:, i]) for i in range(3))
    o, d = _columns(origin), _columns(direction)
    e1, e2, s = _minus(v1, v0), _minus(v2, v0), _minus(o, v0)
    p, q = _cross(d, e2), _cross(s, e1)
    below = _dot(e1, p)
    sign = np.where(below < 0, -1, 1)
    below, u, v, above = (sign * x for x in (below, _dot(s, p), _dot(d, q), _dot(e2, q)))
    inside = ((below > 0) & (u >= 0) & (v >= 0) & (u + v <= below)).astype(bool)
    first, second = (_quotients(x, below, inside) for x in (u, v))
    if position >= heading:
        above = above << (position - heading)
    else:
        below = below << (heading - position)
    return ExactPairs(inside, above, below, first, second)


def nearest_of_pairs(triangles: np.ndarray, ray: np.ndarray, triangle: np.ndarray,
                     origins: np.ndarray, directions: np.ndarray, t_min: np.ndarray,
                     t_max: np.ndarray) -> Hits:
    """Return the exact nearest hit of n rays among k pairs of ray and triangle.

    Among triangles at equal t, the lowest index wins.

    Parameters
    ----------
    triangles : (m, 3, 3), of float32 values
    ray, triangle : (k,) int, the pairs
    origins, directions : (n, 3), of float32 values
    t_min, t_max : (n,), of float32 values, in units of |direction|; both ends are included
    """
    n = len(origins)
    hits = Hits(t=np.full(n, np.inf), u=np.zeros(n), v=np.zeros(n),
                triangle=np.full(n, -1, np.int32), status=np.zeros(n, np.uint8))
    best_above, best_below = np.zeros(n, object), np.ones(n, object)
    order = np.lexsort((triangle, ray))
    ray, triangle = ray[order], triangle[order]
    starts = np.flatnonzero(np.diff(ray, prepend=-1))
    rank = np.arange(len(ray)) - np.repeat(starts, np.diff(starts, append=len(ray)))
    # Batch r holds the r-th triangle of each ray, so a ray occurs at most once in a batch.
    for r in range(rank.max(initial=-1) + 1):
        batch = np.flatnonzero(rank == r)
        for part in (batch[i:i + _PAIRS] for i in range(0, len(batch), _PAIRS)):
            rays, some = ray[part], triangle[part]
            pair = solve_pairs(triangles[some], origins[rays], directions[rays])
            nearer = pair.within(t_min[rays], t_max[rays])
            nearer &= ((hits.triangle[rays] < 0) | (
                pair.above * best_below[rays] < best_above[rays] * pair.below).astype(bool))
            rays = rays[nearer]
            best_above[rays], best_below[rays] = pair.above[nearer], pair.below[nearer]
            hits.triangle[rays] = some[nearer]
            hits.t[rays] = pair.t[nearer]
            hits.u[rays], hits.v[rays] = pair.u[nearer], pair.v[nearer]
    return hits


@public_call
def trace_exact(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray,
                t_min: float | np.ndarray = 0.0, t_max: float | np.ndarray = np.inf) -> Hits:
    """Return nearest hits, with t, u and v rounded correctly from exact values to float64.

    A ray in a triangle's plane misses the triangle. The ends of the interval, edges and vertices
    are included. Among triangles at equal t, the lowest index wins.

    Parameters
    ----------
    triangles : (m, 3, 3), world units, rounded to float32
    origins, directions : (n, 3), finite, rounded to float32
    t_min, t_max : numbers, or a value per ray, in units of |direction|, rounded to float32
    """
    triangles, origins, directions = (np.asarray(a, np.float32)
                                      for a in (triangles, origins, directions))
    n = len(origins)
    ends = (np.broadcast_to(np.asarray(end, np.float32), n) for end in (t_min, t_max))
    ray, triangle = np.divmod(np.arange(n * len(triangles)), max(len(triangles), 1))
    return nearest_of_pairs(triangles, ray, triangle, origins, directions, *ends)


def _integers(*arrays: np.ndarray) -> tuple[list[np.ndarray], int]:
    """Return an array of integers for each given array, and an exponent e: each given number
    equals its integer times 2^e."""
    parts = [np.frexp(np.asarray(array, np.float64)) for array in arrays]
    least = min((int(exponent[number != 0].min(initial=1 << 30)) for number, exponent in parts),
                default=0)
    least = least if least < 1 << 30 else 0
    found = []
    for number, exponent in parts:
        whole = np.ldexp(number, _BITS).astype(np.int64).astype(object)
        found.append(whole << np.where(number == 0, 0, exponent - least).astype(object))
    return found, least - _BITS


Columns = tuple[np.ndarray, np.ndarray, np.ndarray]     # a vector's components, (k,) each


def _columns(vectors: np.ndarray) -> Columns:
    return vectors[:, 0], vectors[:, 1], vectors[:, 2]


def _minus(a: Columns, b: Columns) -> Columns:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _dot(a: Columns, b: Columns) -> np.ndarray:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Columns, b: Columns) -> Columns:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _quotients(above: np.ndarray, below: np.ndarray, where: np.ndarray) -> np.ndarray:
    """Return (k,) float64, the correctly rounded quotients; NaN where ``where`` is false."""
    found = np.full(len(above), np.nan)
    found[where] = (above[where] / below[where]).astype(np.float64)
    return found
