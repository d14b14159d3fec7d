"""The watertight test of ``glsl/core/watertight.glsl`` in numpy, operation for operation.

All arithmetic is float32 and rounds where the shader rounds, so the results have the same bits on
renderers that follow IEEE arithmetic. Numbers below 2^-126 count as 0, as on renderers that flush
denormals.
"""
from __future__ import annotations

import numpy as np

from .error_bounds import FLOAT32
from .plane import Rounding, edges_of, kept, plane_distance

# If all nonzero coordinates and edges have magnitudes of at least SAFE, no denormal occurs before
# the division in `plane_distance`. The test multiplies at most three such numbers, so a product is
# at least 2^-75. It subtracts at most twice, and a nonzero difference is at least 2^-24 times its
# larger operand. So a nonzero result is at least 2^(-75 - 48), above 2^-126, the least normal
# number. After the division, a denormal needs components of a normal that differ by 2^126 times.
SAFE = np.float32(2.0 ** -25)


def intersect_pairs(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray
                    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Test k pairs of ray and triangle.

    Parameters
    ----------
    triangles : (k, 3, 3) float32
    origins, directions : (k, 3) float32, finite, directions not zero

    Returns
    -------
    (k,) bool, whether the ray's line meets the triangle; then t, u and v, (k,) float32 each,
    undefined on a miss. t is in units of the direction's length and may be negative.
    """
    exponent = np.frexp(np.abs(directions).max(axis=1, initial=0))[1]
    scaled = np.ldexp(directions, -exponent[:, None])
    order = (np.abs(scaled).argmax(axis=1)[:, None] + (1, 2, 3)) % 3
    with np.errstate(all="ignore"):
        found, least = _decide(triangles, origins, scaled, order, kept)
        small = np.flatnonzero(least < SAFE)
        if len(small):
            few, _ = _decide(triangles[small], origins[small], scaled[small], order[small],
                             _flushed)
            for values, again in zip(found, few):
                values[small] = again
        accepted, t, u, v = found
        return accepted, np.ldexp(_flushed(t), -exponent), _flushed(u), _flushed(v)


def _flushed(values: np.ndarray) -> np.ndarray:
    return np.where(np.abs(values) < FLOAT32.tiny, np.copysign(np.float32(0), values), values)


def _decide(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray,
            order: np.ndarray, R: Rounding) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    """Apply the test, and round the result of each operation with ``R``. Return (accepted, t, u,
    v), and the least magnitude among each pair's nonzero coordinates and edges, (k,).

    ``order`` (k, 3) permutes the axes so that the direction is largest in the last axis.
    """
    o, d = (R(np.take_along_axis(a, order, 1).T) for a in (origins, directions))
    corners = R(np.take_along_axis(triangles, order[:, None], 2).transpose(1, 2, 0))
    seen = R(corners - o)
    x, y, z = seen.swapaxes(0, 1)
    shear_x, shear_y, shear_z = R(d[0] / d[2]), R(d[1] / d[2]), R(np.float32(1) / d[2])
    x, y = R(x - R(shear_x * z)), R(y - R(shear_y * z))
    w0 = R(R(x[2] * y[1]) - R(y[2] * x[1]))
    w1 = R(R(x[0] * y[2]) - R(y[0] * x[2]))
    w2 = R(R(x[1] * y[0]) - R(y[1] * x[0]))
    det = R(R(w0 + w1) + w2)
    lowest, highest = np.minimum(np.minimum(w0, w1), w2), np.maximum(np.maximum(w0, w1), w2)
    accepted = ((lowest >= 0) | (highest <= 0)) & (np.abs(det) >= FLOAT32.tiny)
    for a, b, c in (x, y):
        accepted &= ((np.minimum(np.minimum(a, b), c) <= 0)
                     & (np.maximum(np.maximum(a, b), c) >= 0))
    inv_det = R(np.float32(1) / det)
    depths = R(z * shear_z)
    nearest, furthest = depths.min(axis=0), depths.max(axis=0)
    t = plane_distance(corners, seen, d, R)
    t = np.where(t > nearest, np.where(t < furthest, t, furthest), nearest)
    values = np.abs(np.concatenate([*seen, *edges_of(corners, R), d, x, y]))
    least = np.min(values, axis=0, initial=np.inf, where=values != 0)
    return (accepted, t, R(w1 * inv_det), R(w2 * inv_det)), least
