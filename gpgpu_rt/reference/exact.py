"""Exact hits: nearest hits in rational numbers, for the few rays that float64 cannot decide.

Cramer's rule solves ``o + t d = (1 - u - v) v0 + u v1 + v v2``. Only the final result is rounded.
The loop over rays and triangles is in Python and takes about 10 microseconds per pair.
"""
from __future__ import annotations

from fractions import Fraction

import numpy as np

from ..hits import Hits

Vector = tuple[Fraction, Fraction, Fraction]


def trace_exact(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray,
                t_min: float = 0.0, t_max: float = np.inf) -> Hits:
    """Return nearest hits, exact up to the rounding of t, u and v to float64 at the end.

    A ray in a triangle's plane misses the triangle. The ends of the interval, edges and vertices
    are included. Among triangles at equal t, the lowest index wins.

    Parameters
    ----------
    triangles : (m, 3, 3), world units, rounded to float32
    origins, directions : (n, 3), finite, rounded to float32
    t_min, t_max : in units of |direction|, rounded to float32
    """
    corners = [[_vector(corner) for corner in triangle] for triangle in np.float32(triangles)]
    edges = [(v0, _minus(v1, v0), _minus(v2, v0)) for v0, v1, v2 in corners]
    first, last = (float(np.float32(end)) for end in (t_min, t_max))
    n = len(origins)
    hits = Hits(t=np.full(n, np.inf), u=np.zeros(n), v=np.zeros(n),
                triangle=np.full(n, -1, np.int32), status=np.zeros(n, np.uint8))
    for ray, (o, d) in enumerate(zip(np.float32(origins), np.float32(directions))):
        nearest = None
        o, d = _vector(o), _vector(d)
        for index, (v0, e1, e2) in enumerate(edges):
            found = _solve(o, d, v0, e1, e2)
            if found and first <= found[0] <= last and (nearest is None or found[0] < nearest):
                nearest = found[0]
                hits.triangle[ray] = index
                hits.t[ray], hits.u[ray], hits.v[ray] = (float(x) for x in found)
    return hits


def _solve(o: Vector, d: Vector, v0: Vector, e1: Vector, e2: Vector) -> Vector | None:
    """Return t, u and v where the line meets the triangle, or None."""
    p = _cross(d, e2)
    det = _dot(e1, p)
    if det == 0:
        return None
    s = _minus(o, v0)
    u = _dot(s, p) / det
    if u < 0 or u > 1:
        return None
    q = _cross(s, e1)
    v = _dot(d, q) / det
    if v < 0 or u + v > 1:
        return None
    return _dot(e2, q) / det, u, v


def _vector(entries: np.ndarray) -> Vector:
    return tuple(Fraction(float(entry)) for entry in entries)


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _dot(a: Vector, b: Vector) -> Fraction:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
