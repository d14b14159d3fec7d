"""Shapes of the extreme cases, and points to aim rays at."""
from __future__ import annotations

import numpy as np
import trimesh

Rays = tuple[np.ndarray, np.ndarray]


def bumpy_sphere(subdivisions: int = 3, at: np.ndarray | float = 0.0) -> np.ndarray:
    """A closed bumpy sphere, (20 4^subdivisions, 3, 3) float32.

    Shared vertices are equal to the bit. The sphere is star-shaped around its centre ``at``, with
    radii from 0.8 to 1.2.
    """
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions)
    v = np.asarray(mesh.vertices)
    v = v * (1 + 0.1 * np.sin(7 * v[:, :1]) + 0.1 * np.cos(5 * v[:, 1:2] + 3 * v[:, 2:]))
    return (v + at).astype(np.float32)[np.asarray(mesh.faces)]


def soup(count: int, seed: int, size: float = 0.2) -> np.ndarray:
    """(count, 3, 3) float32 random triangles in about the unit box.

    Every seventh triangle is perpendicular to an axis.
    """
    rng = np.random.default_rng(seed)
    corners = rng.random((count, 1, 3)) + size * rng.normal(size=(count, 3, 3))
    corners[::7, :, seed % 3] = corners[::7, :1, seed % 3]
    return corners.astype(np.float32)


def lattice(cells: int) -> np.ndarray:
    """The walls of an eighth of the cells of a lattice in the unit box, float32.

    Along each axis, every second cell has walls. For even ``cells``, the result is (12 (cells /
    2)^3, 3, 3).

    Coordinates are exact, so rays can run in planes, through edges and through corners.
    """
    cube = np.asarray(trimesh.creation.box((1, 1, 1)).triangles) + 0.5
    at = np.stack(np.meshgrid(*[np.arange(0, cells, 2)] * 3), -1).reshape(-1, 1, 1, 3)
    return ((cube + at) / cells).reshape(-1, 3, 3).astype(np.float32)


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def aims_at(triangles: np.ndarray, n: int, rng: np.random.Generator, at: str) -> np.ndarray:
    """(n, 3) float64 random points: vertices, points of edges, or points inside triangles."""
    corners = triangles.astype(np.float64)[rng.integers(len(triangles), size=n)]
    weights = rng.dirichlet((1, 1, 1), n)
    if at != "insides":
        weights[:, 2] = 0
        if at == "vertices":
            weights[:, 1] = 0
        weights = np.take_along_axis(weights / weights.sum(1, keepdims=True),
                                     (np.arange(3) + rng.integers(3, size=(n, 1))) % 3, 1)
    return (corners * weights[..., None]).sum(axis=1)


def square(quads: int) -> np.ndarray:
    """The square [-1, 1]^2 at z = -1, (2 quads^2, 3, 3) float32."""
    side = np.linspace(-1, 1, quads + 1).astype(np.float32)
    x, y = np.meshgrid(side, side)
    v = np.stack([x, y, np.full_like(x, -1)], -1)
    a, b, c, d = v[:-1, :-1], v[:-1, 1:], v[1:, 1:], v[1:, :-1]
    return np.stack([a, b, c, a, c, d], 2).reshape(-1, 3, 3)


def outside_rays(triangles: np.ndarray, n: int, rng: np.random.Generator,
                 distance: float = 1.0) -> Rays:
    """Rays from a sphere around the scene to points of the scene's triangles.

    The radius of the sphere is ``distance`` times the diagonal of the scene.
    """
    corners = triangles.reshape(-1, 3).astype(np.float64)
    lo, hi = corners.min(axis=0), corners.max(axis=0)
    origins = (lo + hi) / 2 + distance * np.linalg.norm(hi - lo) * unit(rng.normal(size=(n, 3)))
    origins = origins.astype(np.float32)
    return origins, aims_at(triangles, n, rng, "insides") - origins
