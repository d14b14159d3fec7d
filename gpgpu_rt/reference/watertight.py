"""The watertight test of ``glsl/common/triangle.glsl`` in numpy, operation for operation.

Float32 throughout and rounded where the shader rounds, so that the bits are the same wherever a
renderer keeps to IEEE arithmetic: what rays start from can be chosen on the host by the very test
that they will meet.
"""
from __future__ import annotations

import numpy as np


def intersect_pairs(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray
                    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Decide k pairs of ray and triangle.

    Parameters
    ----------
    triangles : (k, 3, 3) float32
    origins, directions : (k, 3) float32, finite, directions not zero

    Returns
    -------
    (k,) bool, whether the ray's line passes the triangle; (k,) float32 t, in units of the
    direction's length, of either sign, u and v. The last three mean nothing where the first is
    false.
    """
    exponent = np.frexp(np.abs(directions).max(axis=1, initial=0))[1]
    scaled = np.ldexp(directions, -exponent[:, None])
    order = (np.abs(scaled).argmax(axis=1)[:, None] + (1, 2, 3)) % 3
    o, d = (np.take_along_axis(a, order, 1).T for a in (origins, scaled))
    x, y, z = [], [], []
    with np.errstate(all="ignore"):
        shear_x, shear_y, shear_z = d[0] / d[2], d[1] / d[2], np.float32(1) / d[2]
        for corner in np.take_along_axis(triangles, order[:, None], 2).transpose(1, 2, 0):
            a = corner - o
            x.append(a[0] - shear_x * a[2])
            y.append(a[1] - shear_y * a[2])
            z.append(a[2])
        w0 = x[2] * y[1] - y[2] * x[1]
        w1 = x[0] * y[2] - y[0] * x[2]
        w2 = x[1] * y[0] - y[1] * x[0]
        det = w0 + w1 + w2
        lowest, highest = np.minimum(np.minimum(w0, w1), w2), np.maximum(np.maximum(w0, w1), w2)
        accepted = ((lowest >= 0) | (highest <= 0)) & (det != 0)
        for a, b, c in (x, y):
            accepted &= ((np.minimum(np.minimum(a, b), c) <= 0)
                         & (np.maximum(np.maximum(a, b), c) >= 0))
        inv_det = np.float32(1) / det
        t = (w0 * z[0] + w1 * z[1] + w2 * z[2]) * shear_z * inv_det
        return accepted, np.ldexp(t, -exponent), w1 * inv_det, w2 * inv_det
