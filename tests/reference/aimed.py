"""Makes pairs of a triangle and a ray that exercise the triangle test and its error bounds."""
from __future__ import annotations

import numpy as np


def aimed_pairs(kind: str, count: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns triangles, (count, 3, 3), and the rays' origins and directions, (count, 3), in
    float32. Each ray aims at its triangle or, in "beside", next to its triangle.

    kind : one of KINDS. The ray aims "inside" the triangle, at an "edge" or a "vertex", or
        "beside" the triangle. In "small" and "slivers", the triangle is small or narrow. In
        "grazing", the ray goes along the triangle's plane. In "axis", the direction has zeros.
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
        zeros = rng.integers(1, 3, count)  # how many components of each direction are 0
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
