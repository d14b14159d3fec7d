"""Exhaustive search: finds nearest hits in integer arithmetic. If a ray's line meets a triangle's
box, the search tests the triangle, unless float64 already proves a miss.

If the argument ``tree`` of `nearest` is False, the search has a slab test of its own and shares no
code with `gpgpu_rt.reference`. If ``tree`` is True, the search finds candidates in the reference's
tree of boxes and is ten times as fast.

A ray's line meets a triangle if no two of three volumes have different signs. Each volume is
spanned by the ray's direction and by two corners, relative to the origin. The reference uses
Cramer's rule instead.
"""
from __future__ import annotations

import numpy as np

from gpgpu_rt.reference.tree import ReferenceTree

BLOCK = 1 << 22     # largest number of pairs (ray, box) in one slab test


def nearest(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray,
            t_min: np.ndarray, t_max: np.ndarray, tree: bool = False
            ) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangle (n,) and t (n,) of each ray's nearest hit; -1 and inf for a miss."""
    n = len(origins)
    found, t_found = np.full(n, -1), np.full(n, np.inf)
    first, last = (np.broadcast_to(end, n).astype(object) for end in (t_min, t_max))
    search = candidates_of_tree if tree else candidates
    ray, triangle = straddling(triangles, origins, directions,
                               *search(triangles, origins, directions))
    best = [None] * n
    exact = volumes(triangles[triangle], origins[ray], directions[ray])
    # The t of a hit is the fraction above / below of two integers. `outside` also converts t_min
    # and t_max to fractions. Compare fractions exactly, by products of integers.
    for one, which, above, below in zip(ray.tolist(), triangle.tolist(), *exact):
        if not below or outside(above, below, first[one], last[one]):
            continue
        held = best[one]
        if held is None or (above * held[1], which) < (held[0] * below, held[2]):
            best[one] = above, below, which
    for one, some in enumerate(best):
        if some is not None:
            found[one], t_found[one] = some[2], some[0] / some[1]
    return found, t_found


def outside(above: int, below: int, first: float, last: float) -> bool:
    """Return whether t = above / below lies outside the interval [first, last]."""
    for end, sign in ((float(first), 1), (float(last), -1)):
        if np.isinf(end):
            if end * sign > 0:
                return True
            continue
        number, scale = end.as_integer_ratio()
        if sign * (above * scale - number * below) < 0:
            return True
    return False


def candidates(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray
               ) -> tuple[np.ndarray, np.ndarray]:
    """Return all pairs (ray, triangle) in which the ray's line meets the triangle's box.

    Each box is widened by more than the rounding errors of float64. Boxes around groups of up to
    16 triangles are tested first.
    """
    o, d = origins.astype(np.float64), directions.astype(np.float64)
    lo, hi = (fold(triangles.astype(np.float64), 1) for fold in (np.min, np.max))
    middle = (lo + hi) / 2
    size = np.maximum(np.ptp(middle, 0), 1e-300)
    order = np.lexsort(np.floor(8 * (middle - middle.min(0)) / size).T)
    starts = np.arange(0, len(order), 16)
    group_lo = np.minimum.reduceat(lo[order], starts)
    group_hi = np.maximum.reduceat(hi[order], starts)
    rays, groups = [], []
    step = max(1, BLOCK // len(starts))
    for at in range(0, len(o), step):
        part = np.arange(at, min(at + step, len(o)))
        one, other = np.divmod(np.arange(len(part) * len(starts)), len(starts))
        meets = in_slabs(o[part][one], d[part][one], group_lo[other], group_hi[other])
        rays.append(part[one[meets]])
        groups.append(other[meets])
    ray, group = np.concatenate(rays), np.concatenate(groups)
    ray, place = np.repeat(ray, 16), (16 * group[:, None] + np.arange(16)).ravel()
    ray, triangle = ray[place < len(order)], order[place[place < len(order)]]
    meets = in_slabs(o[ray], d[ray], lo[triangle], hi[triangle])
    return ray[meets], triangle[meets]


def candidates_of_tree(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray
                       ) -> tuple[np.ndarray, np.ndarray]:
    """Return pairs as `candidates` does, but find them in the reference's tree of boxes."""
    n = len(origins)
    found = list(ReferenceTree(triangles.astype(np.float64)).pairs(
        origins.astype(np.float64), directions.astype(np.float64), np.full(n, -np.inf),
        np.full(n, np.inf)))
    return tuple(np.concatenate([pair[i] for pair in found] or [np.zeros(0, int)])
                 for i in range(2))


def straddling(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray,
               ray: np.ndarray, triangle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs (ray, triangle) that may be hits. Drop a pair if two of its three volumes
    have different signs, and the sizes of both exceed the rounding errors of float64."""
    o, d = origins.astype(np.float64)[ray], directions.astype(np.float64)[ray]
    d = d / np.abs(d).max(1, keepdims=True)
    size = np.abs(triangles.astype(np.float64)).max() + np.abs(o).max(1)
    a, b, c = ((triangles.astype(np.float64)[triangle, i] - o) for i in range(3))
    reach = np.maximum(np.maximum(np.abs(a).max(1), np.abs(b).max(1)), np.abs(c).max(1))
    slack = 1e-13 * reach * (reach + size)
    parts = np.stack([dot(d, cross(q, p)) for p, q in ((b, c), (c, a), (a, b))])
    kept = ~((parts > slack).any(0) & (parts < -slack).any(0))
    return ray[kept], triangle[kept]


def in_slabs(o: np.ndarray, d: np.ndarray, lo: np.ndarray, hi: np.ndarray) -> np.ndarray:
    """Return whether each line meets its box.

    A line misses a box if an axis separates the two. It suffices to test three axes: the cross
    products of the line's direction with the coordinate axes.
    """
    pad = 1e-12 * (np.abs(o).max(1) + np.abs(lo).max(1) + np.abs(hi).max(1))[:, None] + 1e-300
    a, b = lo - o - pad, hi - o + pad
    meets = np.ones(len(o), bool)
    with np.errstate(over="ignore", invalid="ignore"):
        for i, j in ((0, 1), (1, 2), (2, 0)):
            # At a point p on the line, relative to o, d_i p_j - d_j p_i is 0. So the range of
            # this difference over the box must contain 0.
            first, second = d[:, i, None] * np.stack([a[:, j], b[:, j]], 1), \
                d[:, j, None] * np.stack([a[:, i], b[:, i]], 1)
            least, most = first.min(1) - second.max(1), first.max(1) - second.min(1)
            slack = 1e-15 * (np.abs(first).max(1) + np.abs(second).max(1))
            meets &= ~((least > slack) | (most < -slack))
    return meets


def volumes(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray
            ) -> tuple[list, list]:
    """Return two integers, above and below, for each pair (ray, triangle): t = above / below. For
    a miss, below is 0."""
    scale = 149     # every float32 is a multiple of 2^-149
    v, o, d = (whole(array, scale) for array in (triangles, origins, directions))
    a, b, c = (v[:, i] - o for i in range(3))
    first, second, third = (dot(d, cross(q, p)) for p, q in ((b, c), (c, a), (a, b)))
    inside = ((first >= 0) & (second >= 0) & (third >= 0)
              | (first <= 0) & (second <= 0) & (third <= 0))
    total = first + second + third
    normal = cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0])
    above, below = dot(normal, a), dot(normal, d)
    sign = np.where(below < 0, -1, 1)
    valid = inside & (total != 0) & (below != 0)
    return list(sign * above), list(np.where(valid, sign * below, 0))


def whole(values: np.ndarray, scale: int) -> np.ndarray:
    """Return float32 values, multiplied by 2^scale, as Python integers."""
    fraction, exponent = np.frexp(values.astype(np.float64))
    number = np.ldexp(fraction, 24).astype(np.int64).astype(object)
    shift = exponent.astype(int) - 24 + scale
    low = np.where(shift < 0, -shift, 0).astype(object)
    return (number >> low) << np.where(shift > 0, shift, 0).astype(object)


def cross(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    return np.stack([p[:, (i + 1) % 3] * q[:, (i + 2) % 3]
                     - p[:, (i + 2) % 3] * q[:, (i + 1) % 3] for i in range(3)], 1)


def dot(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    return p[:, 0] * q[:, 0] + p[:, 1] * q[:, 1] + p[:, 2] * q[:, 2]
