"""Far origins: moves far origins of rays along their rays to places near the scene.

A shader computes a point of a ray with an error of a few times 2^-24 of the point's distance from
the origin. Builders widen boxes by `bounds.PADDING` times the largest coordinate. This padding
exceeds the error only if the origin is at most a few times the scene's size away. A ray from
further away could miss cells and leaves. Moving the origin in float64 adds an error of half a
float32 spacing at the scene. Without the move, the triangle test would make a larger error.
"""
from __future__ import annotations

import numpy as np

# Lengths are in radii of the sphere around the scene's box. An origin is far if its distance from
# the sphere's centre exceeds FAR. A far origin moves forward along its ray. It stops at the
# distance NEAR before the ray's point closest to the centre. No origin moves backward.
FAR = 4.0
NEAR = 2.0
ABREAST = 512       # points per row in `by_axis`; numpy reduces long rows faster


def approach(origins: np.ndarray, directions: np.ndarray, lo: np.ndarray,
             hi: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
    """Move far origins along their rays to near the scene.

    Parameters
    ----------
    origins, directions : (n, 3) float32, world units; directions of length near 1. A ray
        whose origin or direction is not finite does not affect the other rays
    lo, hi : (3,), the scene's bounds

    Returns
    -------
    (n, 3) float32 origins; and (n,) float64, the distance that each origin was moved, in units of
    its direction's length. The distances are None if no origin was moved
    """
    centre, radius = sphere(lo, hi)
    if not len(origins) or _near(origins, centre, radius):
        return origins, None
    offset = centre - origins.astype(np.float64)
    distance = (offset ** 2).sum(axis=1)
    far = np.flatnonzero((distance > (FAR * radius) ** 2) & (distance < np.inf))
    if not len(far):
        return origins, None
    shift = np.zeros(len(origins))
    d = directions[far].astype(np.float64)
    length = np.sqrt((d ** 2).sum(axis=1))
    ahead = np.maximum((offset[far] * d).sum(axis=1) / length - NEAR * radius, 0) / length
    # Round the shift to float32. Then t plus the shift is exact if this sum, the distance from the
    # original origin, is a simple number such as 10.
    shift[far] = ahead.astype(np.float32)
    moved = origins.copy()
    moved[far] = origins[far] + shift[far, None] * d
    return moved, shift


def _near(origins: np.ndarray, centre: np.ndarray, radius: float) -> bool:
    """Return whether the box around all origins shows that no origin is far. Origins with a NaN do
    not count."""
    ends = np.array([by_axis(end, origins) for end in (np.fmin, np.fmax)], np.float64)
    return radius == 0 or bool(
        (np.abs(ends - centre).max(axis=0) ** 2).sum() <= (FAR * radius) ** 2)


def by_axis(extreme: np.ufunc, points: np.ndarray) -> np.ndarray:
    """Return the minimum or maximum (``extreme``) of (n, k) points along each axis, (k,)."""
    rows, axes = len(points) // ABREAST * ABREAST, points.shape[1]
    wide = points[:rows].reshape(-1, ABREAST * axes)
    parts = [extreme.reduce(wide, axis=0).reshape(-1, axes)] if rows else []
    return extreme.reduce(np.concatenate([*parts, points[rows:]]), axis=0)


def sphere(lo: np.ndarray, hi: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the centre, (3,) float64, and the radius of the sphere around a box."""
    lo, hi = np.asarray(lo, np.float64), np.asarray(hi, np.float64)
    return (lo + hi) / 2, float(np.linalg.norm(hi - lo)) / 2
