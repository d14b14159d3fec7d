"""Spawn: the origins of rays that leave hit points, computed as in ``glsl/render/spawn.glsl``."""
from __future__ import annotations

from typing import Any

import numpy as np

from ..accel.bounds import unit_normals
from ..hits import Hits
from ..numerics.error_bounds import FLOAT32, gamma
from ..numerics.watertight import intersect_pairs

_SPAWN_TRIES = 28   # enough to double from _SEEN * extent to the triangle's extent, then bisect
_SEEN = np.float32(8 * FLOAT32.unit)    # usual error of the watertight test / triangle's extent


def spawn(scene: Any, hits: Hits, directions: np.ndarray) -> np.ndarray:
    """Return origins from which new rays leave hit points without hitting the triangle of the hit.

    An origin is offset from the hit point along the triangle's normal, to the side of the new
    direction. The offset is the error bound of the hit point plus the usual error of the
    watertight test in float32. For long thin triangles, the test has larger errors. While the new
    ray hits the triangle of the hit, the offset is therefore doubled, up to the triangle's extent.
    A bisection then reduces the offset to at most 8/7 of the smallest sufficient offset.
    ``glsl/render/spawn.glsl`` derives the offset.

    Parameters
    ----------
    scene : Scene, or (m, 3, 3) triangles, world units
    hits : the hits of n rays
    directions : (n, 3), directions of the new rays; rounded to float32

    Returns
    -------
    (n, 3) float32, NaN for a miss or an invalid direction; trace such rays with ``invalid="miss"``

    Raises
    ------
    ValueError
        the directions have a wrong shape
    """
    triangles = np.asarray(getattr(scene, "triangles", scene), np.float32)
    directions = np.asarray(directions, np.float32)
    if directions.shape != (len(hits), 3):
        raise ValueError(f"directions have shape {directions.shape}; give ({len(hits)}, 3), one "
                         "for each hit")
    origins = np.full((len(hits), 3), np.nan, np.float32)
    some = np.flatnonzero(hits.hit & np.isfinite(directions).all(1) & (directions != 0).any(1))
    corners, leaving = triangles[hits.triangle[some]], directions[some]
    u, v = (np.asarray(b, np.float32)[some, None] for b in (hits.u, hits.v))
    point, error, reach = _hit_points(corners, u, v)
    normal = unit_normals(corners)
    with np.errstate(over="ignore"):
        away = (normal.astype(np.float64) * leaving).sum(axis=1, keepdims=True) < 0
        normal = np.where(away, -normal, normal)
        low = offset = (np.abs(normal) * error).sum(axis=1, keepdims=True) + _SEEN * reach
        high = np.full_like(low, np.inf)
        rest = np.arange(len(some))
        for _ in range(_SPAWN_TRIES):
            start = point[rest] + normal[rest] * offset
            origins[some[rest]] = start
            accepted, t, _, _ = intersect_pairs(corners[rest], start, leaving[rest])
            hits_itself = (accepted & (t >= 0))[:, None]
            low, high = np.where(hits_itself, offset, low), np.where(hits_itself, high, offset)
            further = _further(offset, low, high, reach[rest])
            changed = (further != offset)[:, 0]
            if not changed.any():
                break
            rest, offset, low, high = (a[changed] for a in (rest, further, low, high))
    return origins


def _further(offset: np.ndarray, low: np.ndarray, high: np.ndarray, most: np.ndarray
             ) -> np.ndarray:
    """Return the next offsets, (k, 1) float32. Double until an offset succeeds, then bisect
    between ``low``, the largest offset that failed, and ``high``, the smallest that succeeded."""
    succeeded = np.isfinite(high)
    doubled = np.where(2 * offset <= most, 2 * offset, offset)
    gap = np.where(succeeded, high - low, 0)
    return np.where(succeeded, np.where(8 * gap > high, low + gap / 2, high), doubled)


def _hit_points(corners: np.ndarray, u: np.ndarray, v: np.ndarray
                ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the float32 points of k triangles at u and v, (k, 1) each.

    Returns
    -------
    the points, (k, 3); the error bound of each component of a point, (k, 3); and the triangle's
    extent, (k, 1), which is the largest distance of a corner from the point along an axis
    """
    unit = np.float32(FLOAT32.unit)
    v0, v1, v2 = corners.transpose(1, 0, 2)
    parts = (np.float32(1) - u - v) * v0, u * v1, v * v2
    point = parts[0] + parts[1] + parts[2]
    error = np.float32(gamma(8)) * sum(np.abs(p) for p in parts) + unit * np.abs(v0)
    reach = np.abs(corners - point[:, None]).max(axis=(1, 2))[:, None]
    return point, error, reach
