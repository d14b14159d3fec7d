"""The watertight test of ``glsl/core/triangle.glsl`` in numpy, operation for operation.

All arithmetic is float32 and rounds where the shader rounds. On renderers that follow IEEE
arithmetic, the results therefore have the same bits. The host uses this test when it chooses the
origin of a ray that leaves a triangle, so that the shader's test will miss this triangle. Numbers
below 2^-126 count as 0, as on renderers that flush denormals.
"""
from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .error_bounds import FLOAT32

# If all nonzero coordinates are at least SAFE, no nonzero result up to the determinant and the
# depth is below 2^-123, so no denormal occurs. The reason is that the test multiplies at most
# three coordinates and subtracts twice, and that a nonzero difference is at least 2^-24 of its
# larger operand.
SAFE = np.float32(2.0 ** -25)
_Columns = list[np.ndarray]


def intersect_pairs(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray
                    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Test k pairs of ray and triangle.

    Parameters
    ----------
    triangles : (k, 3, 3) float32
    origins, directions : (k, 3) float32, finite, directions not zero

    Returns
    -------
    (k,) bool, whether the ray's line meets the triangle; and t, u and v, (k,) float32 each,
    undefined where the line misses. t is in units of the direction's length and may be negative.
    """
    exponent = np.frexp(np.abs(directions).max(axis=1, initial=0))[1]
    scaled = np.ldexp(directions, -exponent[:, None])
    order = (np.abs(scaled).argmax(axis=1)[:, None] + (1, 2, 3)) % 3
    o, d = (list(np.take_along_axis(a, order, 1).T) for a in (origins, scaled))
    corners = [list(corner) for corner
               in np.take_along_axis(triangles, order[:, None], 2).transpose(1, 2, 0)]
    with np.errstate(all="ignore"):
        found, least = _decide(corners, o, d, _kept)
        small = np.flatnonzero(least < SAFE)
        if len(small):
            few, _ = _decide([[c[small] for c in corner] for corner in corners],
                             [a[small] for a in o], [a[small] for a in d], _flushed)
            for values, again in zip(found, few):
                values[small] = again
        accepted, t, u, v = found
        return accepted, np.ldexp(_flushed(t), -exponent), _flushed(u), _flushed(v)


def _kept(values: np.ndarray) -> np.ndarray:
    return values


def _flushed(values: np.ndarray) -> np.ndarray:
    return np.where(np.abs(values) < FLOAT32.tiny, np.copysign(np.float32(0), values), values)


def _decide(corners: list[_Columns], o: _Columns, d: _Columns,
            R: Callable[[np.ndarray], np.ndarray]
            ) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    """Apply the test, with ``R`` around each operation. Return (accepted, t, u, v), and the least
    magnitude of a nonzero coordinate of each pair, (k,)."""
    o, d = [R(a) for a in o], [R(a) for a in d]
    x, y, z = [], [], []
    shear_x, shear_y, shear_z = R(d[0] / d[2]), R(d[1] / d[2]), R(np.float32(1) / d[2])
    least = np.full(len(o[0]), np.inf, np.float32)
    for corner in corners:
        a = [R(R(c) - start) for c, start in zip(corner, o)]
        x.append(R(a[0] - R(shear_x * a[2])))
        y.append(R(a[1] - R(shear_y * a[2])))
        z.append(a[2])
        for values in (*a[:2], x[-1], y[-1], z[-1]):
            size = np.abs(values)
            np.minimum(least, size, out=least, where=size != 0)
    w0 = R(R(x[2] * y[1]) - R(y[2] * x[1]))
    w1 = R(R(x[0] * y[2]) - R(y[0] * x[2]))
    w2 = R(R(x[1] * y[0]) - R(y[1] * x[0]))
    det = R(R(w0 + w1) + w2)
    lowest, highest = np.minimum(np.minimum(w0, w1), w2), np.maximum(np.maximum(w0, w1), w2)
    accepted = ((lowest >= 0) | (highest <= 0)) & (det != 0)
    for a, b, c in (x, y):
        accepted &= ((np.minimum(np.minimum(a, b), c) <= 0)
                     & (np.maximum(np.maximum(a, b), c) >= 0))
    inv_det = R(np.float32(1) / det)
    t = R(R(R(R(R(w0 * z[0]) + R(w1 * z[1])) + R(w2 * z[2])) * shear_z) * inv_det)
    return (accepted, t, R(w1 * inv_det), R(w2 * inv_det)), least
