"""Mirror: computes the watertight test of `watertight.glsl` in numpy, operation by operation in
float32. With ``contract``, the mirror fuses products and sums into multiply-adds."""
from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import gpgpu_rt as rt

Array = np.ndarray


def fused(a: Array, b: Array, c: Array) -> Array:
    """Returns a * b + c as float32. The product of two float32 values is exact in float64, but the
    sum is rounded twice. The result therefore differs from a true fused multiply-add about once in
    2^29 cases."""
    return (a.astype(np.float64) * b + c).astype(np.float32)


def apart(a: Array, b: Array, c: Array) -> Array:
    """Returns a * b + c in float32, rounded after each operation."""
    return a * b + c


def pairs(corners: Array, origins: Array, directions: Array,
          contract: bool = False) -> tuple[Array, Array, Array, Array]:
    """Tests k pairs of a triangle and a ray; returns t, u, v, (k,) float32 each, and accepted,
    (k,) bool.

    Parameters
    ----------
    corners : (k, 3, 3) float32
    origins, directions : (k, 3) float32
    contract : whether to fuse products and sums, as a compiler may without `precise`
    """
    multiply_add = fused if contract else apart
    size = np.abs(directions)
    exponent = np.frexp(size.max(axis=1))[1]
    d = np.ldexp(directions, -exponent[:, None])
    size = np.abs(d)
    x_first = (size[:, 0] >= size[:, 1]) & (size[:, 0] >= size[:, 2])
    axis = np.where(x_first, 0, np.where(size[:, 1] >= size[:, 2], 1, 2))
    order = (axis[:, None] + [1, 2, 3]) % 3
    p = np.take_along_axis(d, order, 1)
    with np.errstate(all="ignore"):
        shear = p[:, :2] / p[:, 2:]
        a, b, c = (np.take_along_axis(corners[:, k] - origins, order, 1) for k in range(3))
        sa, sb, sc = (multiply_add(-shear, v[:, 2:], v[:, :2]) for v in (a, b, c))

        def edge(one: Array, two: Array) -> Array:
            return multiply_add(one[:, 0], two[:, 1], -(one[:, 1] * two[:, 0]))
        w0, w1, w2 = edge(sc, sb), edge(sa, sc), edge(sb, sa)
        det = w0 + w1 + w2
        lo, hi = np.minimum(np.minimum(sa, sb), sc), np.maximum(np.maximum(sa, sb), sc)
        in_box = (lo <= 0).all(axis=1) & (hi >= 0).all(axis=1)
        lowest, highest = np.minimum(np.minimum(w0, w1), w2), np.maximum(np.maximum(w0, w1), w2)
        inv_det = np.float32(1) / det
        depths = np.stack([a[:, 2], b[:, 2], c[:, 2]]) * (np.float32(1) / p[:, 2])

        def dot(one: Array, two: Array) -> Array:
            return multiply_add(one[:, 2], two[:, 2],
                                multiply_add(one[:, 1], two[:, 1], one[:, 0] * two[:, 0]))
        edges = [np.take_along_axis(corners[:, (k + 2) % 3] - corners[:, (k + 1) % 3], order, 1)
                 for k in range(3)]
        k = np.stack([np.abs(e).max(axis=1) for e in edges]).argmax(axis=0)[:, None]
        one = np.choose(k, (edges[1], edges[0], edges[0]))
        two = np.choose(k, (edges[2], edges[2], edges[1]))
        normal = np.stack([multiply_add(one[:, i], two[:, j], -(one[:, j] * two[:, i]))
                           for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)
        inverse = np.float32(1) / dot(p, normal)
        plane = dot(np.choose(k, (a, b, c)), normal * inverse[:, None])
        plane = np.where(plane > depths.min(axis=0), plane, depths.min(axis=0))
        t = np.ldexp(np.minimum(plane, depths.max(axis=0)), -exponent)
        accepted = in_box & ((lowest >= 0) | (highest <= 0)) & (t >= 0)
        accepted &= np.abs(det) >= 2.0 ** -126
        return t, w1 * inv_det, w2 * inv_det, accepted


def trace(triangles: Array, origins: Array, directions: Array, contract: bool = False) -> rt.Hits:
    """Returns the nearest hit of each ray among all triangles, in float32. The lowest index wins
    ties."""
    n = len(origins)
    hits = rt.Hits(np.full(n, np.inf, np.float32), np.zeros(n, np.float32),
                   np.zeros(n, np.float32), np.full(n, -1, np.int32), np.zeros(n, np.uint8))
    for first, t, u, v in _tables(triangles, origins, directions, contract):
        best = t.argmin(axis=1)[:, None]
        found = np.isfinite(np.take_along_axis(t, best, 1)[:, 0])
        at = np.flatnonzero(found) + first
        for name, values in (("t", t), ("u", u), ("v", v)):
            getattr(hits, name)[at] = np.take_along_axis(values, best, 1)[found, 0]
        hits.triangle[at] = best[found, 0]
    return hits


def hits_a_ray(triangles: Array, origins: Array, directions: Array) -> Array:
    """Returns (n,) int: how many triangles each ray hits within 4 float32 spacings of its nearest
    hit."""
    counts = [np.zeros(0, int)]
    for _, t, _, _ in _tables(triangles, origins, directions, False):
        nearest = t.min(axis=1, keepdims=True)
        reach = nearest + 4 * np.spacing(np.where(np.isfinite(nearest), nearest, 0))
        counts.append((np.isfinite(t) & (t <= reach)).sum(axis=1))
    return np.concatenate(counts)


def _tables(triangles: Array, origins: Array, directions: Array,
            contract: bool) -> Iterator[tuple[int, Array, Array, Array]]:
    """Yields, for each block of r rays, the index of the block's first ray, then t, u and v for m
    triangles, (r, m) each. Rejected pairs have infinite t."""
    n, m = len(origins), len(triangles)
    rows = max(1, (1 << 18) // m)
    for first in range(0, n, rows):
        ray, triangle = (index.ravel() for index in np.mgrid[first:min(first + rows, n), 0:m])
        t, u, v, accepted = pairs(triangles[triangle], origins[ray], directions[ray], contract)
        yield first, *(x.reshape(-1, m) for x in (np.where(accepted, t, np.inf), u, v))
