"""Sight: finds the first triangles along a few rays from one point, without an accelerator."""
from __future__ import annotations

import numpy as np

from ..numerics.watertight import intersect_pairs

_ROWS = 1 << 16      # triangles that are culled at a time, to bound the memory


def first_seen(triangles: np.ndarray, eye: np.ndarray, directions: np.ndarray
               ) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance and the index of the first triangle in each direction.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units
    eye : (3,), the origin of all rays
    directions : (r, 3), of any nonzero length

    Returns
    -------
    (r,) float64 distance in world units, inf on a miss; (r,) int64 triangle, -1 on a miss
    """
    unit = np.asarray(directions, np.float64)
    unit = unit / np.linalg.norm(unit, axis=1, keepdims=True)
    distance, seen = np.full(len(unit), np.inf), np.full(len(unit), -1)
    start = np.asarray(eye, np.float32)
    for first in range(0, len(triangles), _ROWS):
        rows = triangles[first:first + _ROWS].astype(np.float64)
        middle = rows.mean(axis=1)
        radius = ((rows - middle[:, None]) ** 2).sum(axis=2).max(axis=1)
        middle -= start
        along = middle @ unit.T
        # Enlarge the squared radius by a factor of 1 + 10^-5: rounding must not cull a ray through
        # a corner.
        limit = (middle ** 2).sum(axis=1) * (1 - 1e-9) - radius * (1 + 1e-5)
        row, ray = np.nonzero((limit[:, None] <= along ** 2) & (
            along >= -np.sqrt(radius)[:, None]))
        chosen = triangles[first + row]
        met, t, _, _ = intersect_pairs(chosen, np.broadcast_to(start, (len(row), 3)),
                                       unit[ray].astype(np.float32))
        met &= t > 0
        row, ray, t = row[met], ray[met], t[met].astype(np.float64)
        order = np.lexsort((row, t, ray))
        ray, at = np.unique(ray[order], return_index=True)
        nearer = t[order][at] < distance[ray]
        distance[ray[nearer]] = t[order][at][nearer]
        seen[ray[nearer]] = first + row[order][at][nearer]
    return distance, seen


def shows_back(triangles: np.ndarray, seen: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return (r,) bool, whether each ray meets the back of the triangle that it sees; False on a
    miss."""
    met = seen >= 0
    a, b, c = triangles[seen[met]].astype(np.float64).transpose(1, 0, 2)
    backs = np.zeros(len(seen), bool)
    backs[met] = (np.cross(b - a, c - a) * directions[met]).sum(axis=1) > 0
    return backs
