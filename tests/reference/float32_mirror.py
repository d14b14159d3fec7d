"""The watertight test of glsl/common/triangle.glsl in numpy float32, and pairs to try it on."""
from __future__ import annotations

import numpy as np


def mirror(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray
           ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Accepted, t, u and v of k pairs, operation for operation as the shader has them.

    triangles : (k, 3, 3); origins, directions : (k, 3), all float32
    """
    one = np.float32(1)
    exponent = np.frexp(np.abs(directions).max(axis=1))[1]
    d = np.ldexp(directions, -exponent[:, None])
    order = (np.abs(d).argmax(axis=1)[:, None] + (1, 2, 3)) % 3
    o, d = (np.take_along_axis(a, order, 1).T for a in (origins, d))
    x, y, z = [], [], []
    with np.errstate(all="ignore"):
        shear_x, shear_y, shear_z = d[0] / d[2], d[1] / d[2], one / d[2]
        for corner in np.take_along_axis(triangles, order[:, None], 2).transpose(1, 2, 0):
            a = corner - o
            x.append(a[0] - shear_x * a[2])
            y.append(a[1] - shear_y * a[2])
            z.append(a[2])
        w0 = x[2] * y[1] - y[2] * x[1]
        w1 = x[0] * y[2] - y[0] * x[2]
        w2 = x[1] * y[0] - y[1] * x[0]
        det = w0 + w1 + w2
        in_box = np.ones(len(det), bool)
        for axis in (x, y):
            in_box &= (np.min(axis, axis=0) <= 0) & (np.max(axis, axis=0) >= 0)
        w = np.stack((w0, w1, w2))
        accepted = in_box & ((w >= 0).all(axis=0) | (w <= 0).all(axis=0)) & (det != 0)
        inv_det = one / det
        t = (w0 * z[0] + w1 * z[1] + w2 * z[2]) * shear_z * inv_det
        u, v = w1 * inv_det, w2 * inv_det
    assert t.dtype == u.dtype == np.float32
    return accepted, np.ldexp(t, -exponent), u, v


def aimed_pairs(kind: str, count: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles (count, 3, 3) and rays (count, 3) each aimed at its triangle, float32.

    kind : "inside" its triangle; at an "edge" or a "vertex"; "beside" it; "small" and far;
        "slivers"; "grazing" along its plane; "axis" for directions with zeros in them
    """
    rng = np.random.default_rng(seed)
    size = np.ones((count, 1, 1)) if kind != "small" else 10 ** rng.uniform(-6, -1, (count, 1, 1))
    triangles = rng.normal(size=(count, 1, 3)) + size * rng.normal(size=(count, 3, 3))
    if kind == "slivers":
        along = rng.random((count, 1))
        triangles[:, 2] = (1 - along) * triangles[:, 0] + along * triangles[:, 1]
        triangles[:, 2] += 1e-6 * rng.normal(size=(count, 3))
    triangles = triangles.astype(np.float32)
    weights = rng.dirichlet((1, 1, 1), count)
    if kind == "edge":
        weights[:, 0] = 0
    elif kind == "vertex":
        weights = np.eye(3)[rng.integers(3, size=count)]
    elif kind == "beside":
        weights[:, 0] = -weights[:, 0] * 10 ** rng.uniform(-8, 0, count)
    weights /= weights.sum(axis=1, keepdims=True)
    aim = (weights[:, :, None] * triangles).sum(axis=1)
    origins = rng.normal(size=(count, 3))
    if kind == "grazing":
        in_plane = (rng.dirichlet((1, 1, 1), count)[:, :, None] * triangles).sum(axis=1)
        origins = aim + 4 * (in_plane - aim) + 1e-6 * rng.normal(size=(count, 3))
    elif kind == "axis":
        zeros = rng.integers(1, 3, count)   # of the direction's components
        for k, axis in enumerate(rng.permuted(np.tile((0, 1, 2), (count, 1)), axis=1).T[:2]):
            some = np.flatnonzero(zeros > k)
            origins[some, axis[some]] = aim[some, axis[some]]
    origins = origins.astype(np.float32)
    directions = aim - origins
    if kind == "axis":
        directions[np.abs(directions) < 1e-6] = 0
    length = 10.0 ** rng.integers(-6, 7, (count, 1))
    directions = (directions * length).astype(np.float32)
    directions[(directions == 0).all(axis=1)] = 1
    return triangles, origins, directions


KINDS = ("inside", "edge", "vertex", "beside", "small", "slivers", "grazing", "axis")
