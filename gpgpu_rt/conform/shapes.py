"""Shapes: makes scenes and rays for families.py, with the same bits on every machine."""
from __future__ import annotations

import numpy as np

from .draws import bell, directions, spread_over, unit

Rays = tuple[np.ndarray, np.ndarray]

_OCTAHEDRON = np.float64([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
_OCTANTS = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4],
                     [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])


def sphere(subdivisions: int) -> np.ndarray:
    """Return a unit sphere, (8 * 4^subdivisions, 3, 3) float64: a subdivided octahedron. Shared
    vertices are equal to the bit."""
    triangles = _OCTAHEDRON[_OCTANTS]
    for _ in range(subdivisions):
        a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
        ab, bc, ca = unit(a + b), unit(b + c), unit(c + a)
        triangles = np.concatenate([np.stack(one, 1) for one in (
            (a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return triangles


def bumpy_sphere(subdivisions: int = 3, at: np.ndarray | float = 0.0) -> np.ndarray:
    """Return a closed bumpy sphere of 8 * 4^(subdivisions + 1) triangles, (n, 3, 3) float32.

    Shared vertices are equal to the bit. The sphere is star-shaped around ``at``, with radii from
    0.8 to 1.2.
    """
    v = sphere(subdivisions + 1)
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    bumps = 0.1 * (4 * x * x - 3) * x * y + 0.12 * (2 * y * z - x * z)
    return (v * (1 + bumps[..., None]) + at).astype(np.float32)


def box(cells: int = 1) -> np.ndarray:
    """Return the closed cube [-1, 1]^3, (12 cells^2, 3, 3) float32, with cells^2 squares per
    face."""
    face = square(cells)
    sides = [np.roll(face, turn, axis=2) for turn in range(3)]
    return np.concatenate([*sides, *(-side[:, ::-1] for side in sides)])


def tube(sections: int, height: float) -> np.ndarray:
    """Return a closed tube of radius 1 along z, (4 * sections, 3, 3) float64. The triangles of its
    wall are as long as the tube; two fans close the tube. ``sections`` is a multiple of 4.

    For s from 0 to 1, (1 - s^2, 2 s) / (1 + s^2) is a quarter of the circle.
    """
    s = np.arange(sections // 4) / (sections // 4)
    x, y = (1 - s * s) / (1 + s * s), 2 * s / (1 + s * s)
    x, y = np.concatenate([x, -y, -x, y]), np.concatenate([y, x, -y, -x])
    low = np.stack([x, y, np.full_like(x, -height / 2)], -1)
    high = low * [1, 1, -1]
    next_low, next_high = np.roll(low, -1, axis=0), np.roll(high, -1, axis=0)
    ends = [np.broadcast_to([0, 0, z], low.shape) for z in (-height / 2, height / 2)]
    return np.concatenate([np.stack(one, 1) for one in (
        (low, next_low, high), (high, next_low, next_high), (ends[0], next_low, low),
        (ends[1], high, next_high))])


def soup(count: int, seed: int, size: float = 0.2) -> np.ndarray:
    """Return (count, 3, 3) float32 random triangles in about the unit box.

    Every seventh triangle is perpendicular to an axis.
    """
    rng = np.random.default_rng(seed)
    corners = rng.random((count, 1, 3)) + size * bell(rng, (count, 3, 3))
    corners[::7, :, seed % 3] = corners[::7, :1, seed % 3]
    return corners.astype(np.float32)


def lattice(cells: int) -> np.ndarray:
    """Divide the unit box into cells^3 cells. Return the walls of cells with three even indices.

    The result is (12 (cells / 2)^3, 3, 3) float32 for even ``cells``.

    If ``cells`` is a power of two, coordinates are exact, so rays can run in planes, through edges
    and through corners.
    """
    cube = (box().astype(np.float64) + 1) / 2
    at = np.stack(np.meshgrid(*[np.arange(0, cells, 2)] * 3), -1).reshape(-1, 1, 1, 3)
    return ((cube + at) / cells).reshape(-1, 3, 3).astype(np.float32)


def square(quads: int) -> np.ndarray:
    """Return the square [-1, 1]^2 at z = -1, (2 quads^2, 3, 3) float32."""
    side = ((2.0 * np.arange(quads + 1) - quads) / quads).astype(np.float32)
    x, y = np.meshgrid(side, side)
    v = np.stack([x, y, np.full_like(x, -1)], -1)
    a, b, c, d = v[:-1, :-1], v[:-1, 1:], v[1:, 1:], v[1:, :-1]
    return np.stack([a, b, c, a, c, d], 2).reshape(-1, 3, 3)


def aims_at(triangles: np.ndarray, n: int, rng: np.random.Generator, at: str) -> np.ndarray:
    """Return (n, 3) float64 random points at the parts of triangles that ``at`` names: "vertices",
    "edges" or "insides"."""
    corners = triangles.astype(np.float64)[rng.integers(len(triangles), size=n)]
    weights = spread_over(rng, n)
    if at != "insides":
        weights[:, 1] = 0 if at == "vertices" else 1 - weights[:, 0]
        weights[:, 2] = 0
        if at == "vertices":
            weights[:, 0] = 1
        weights = np.take_along_axis(weights, (np.arange(3) + rng.integers(3, size=(n, 1))) % 3, 1)
    weighted = corners * weights[..., None]
    return weighted[:, 0] + weighted[:, 1] + weighted[:, 2]


def outside_rays(triangles: np.ndarray, n: int, rng: np.random.Generator,
                 distance: float = 1.0) -> Rays:
    """Return rays to the scene's triangles from a sphere around the scene. The sphere's radius is
    ``distance`` times the scene's diagonal."""
    corners = triangles.reshape(-1, 3).astype(np.float64)
    lo, hi = corners.min(axis=0), corners.max(axis=0)
    x, y, z = hi - lo
    radius = distance * np.sqrt(x * x + y * y + z * z)
    origins = ((lo + hi) / 2 + radius * directions(rng, n)).astype(np.float32)
    return origins, aims_at(triangles, n, rng, "insides") - origins
