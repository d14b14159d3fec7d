"""Shapes: makes the parts of built-in scenes as (k, 3, 3) float64 triangles. The y axis is up."""
from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from ...threads import threads


def patch(points: np.ndarray) -> np.ndarray:
    """Return the triangles between a grid of points, (r, c, 3). Omit triangles with two equal
    corners, which occur at a pole."""
    a, b = points[:-1, :-1], points[:-1, 1:]
    c, d = points[1:, 1:], points[1:, :-1]
    triangles = np.stack((np.stack((a, b, c), 2), np.stack((a, c, d), 2)), 2).reshape(-1, 3, 3)
    folded = ((triangles == np.roll(triangles, 1, axis=1)).all(axis=2)).any(axis=1)
    return triangles[~folded]


def quad(a: Sequence[float], b: Sequence[float], c: Sequence[float], d: Sequence[float]
         ) -> np.ndarray:
    """Return two triangles, a b c and a c d."""
    return np.array(((a, b, c), (a, c, d)), np.float64)


def floor(lo: Sequence[float], hi: Sequence[float], height: float, cells: int = 1) -> np.ndarray:
    """Return a horizontal rectangle of cells x cells x 2 triangles. lo and hi are (x, z)."""
    x, z = np.meshgrid(np.linspace(lo[0], hi[0], cells + 1),
                       np.linspace(lo[1], hi[1], cells + 1), indexing="ij")
    return patch(np.stack((x, np.full_like(x, height), z), axis=-1))


@cache
def _cube() -> np.ndarray:
    corner = np.array(np.meshgrid((0, 1), (0, 1), (0, 1), indexing="ij")).reshape(3, 8).T
    sides = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    return np.concatenate([quad(*corner[list(side)].tolist()) for side in sides])


def boxes(lo: np.ndarray, hi: np.ndarray) -> np.ndarray:
    """Return twelve triangles for each of m boxes; lo and hi are (m, 3) or (3,)."""
    lo, hi = (np.atleast_2d(np.asarray(a, np.float64))[:, None, None] for a in (lo, hi))
    return (lo + (hi - lo) * _cube()).reshape(-1, 3, 3)


def revolve(profile: Sequence[Sequence[float]], segments: int) -> np.ndarray:
    """Return the surface of revolution of a profile of (radius, y) around the y axis."""
    radius, y = np.asarray(profile, np.float64).T[:, :, None]
    angle = np.linspace(0, 2 * np.pi, segments + 1)
    cosine, sine = np.cos(angle), np.sin(angle)
    cosine[-1], sine[-1] = cosine[0], sine[0]
    return patch(np.stack((radius * cosine, y + 0 * angle, radius * sine), axis=-1))


def smooth(profile: Sequence[Sequence[float]], points: int) -> np.ndarray:
    """Return a profile of (radius, y) resampled to ``points`` points of a Catmull-Rom spline."""
    p = np.asarray(profile, np.float64)
    p = np.concatenate((2 * p[:1] - p[1:2], p, 2 * p[-1:] - p[-2:-1]))
    s = np.linspace(0, len(p) - 3, points)
    i = np.minimum(s.astype(int), len(p) - 4)
    f = (s - i)[:, None]
    a, b, c, d = p[i], p[i + 1], p[i + 2], p[i + 3]
    curve = b + f / 2 * (c - a + f * (2 * a - 5 * b + 4 * c - d + f * (3 * (b - c) + d - a)))
    curve[:, 0] = np.maximum(curve[:, 0], 0)
    return curve


def ball(count: int, centre: Sequence[float] = (0, 0, 0), radii: Sequence[float] = (1, 1, 1),
         bend: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    """Return an ellipsoid of at most `count` triangles, rotated by `bend` = (around x, around z)
    radians."""
    rings = max(2, int((1 + np.sqrt(1 + count)) / 2))
    angle = np.linspace(-np.pi / 2, np.pi / 2, rings + 1)
    profile = np.stack((np.cos(angle), np.sin(angle)), axis=1)
    profile[[0, -1], 0] = 0
    triangles = revolve(profile, max(3, count // (2 * (rings - 1)))) * radii
    return turn(turn(triangles, bend[0], 0), bend[1], 2) + centre


def turn(triangles: np.ndarray, angle: float, axis: int) -> np.ndarray:
    """Return triangles rotated around a coordinate axis by an angle in radians."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turned = triangles.copy()
    turned[..., i] = triangles[..., i] * np.cos(angle) - triangles[..., j] * np.sin(angle)
    turned[..., j] = triangles[..., i] * np.sin(angle) + triangles[..., j] * np.cos(angle)
    return turned


def tube(path: Sequence[Sequence[float]], radius: float | Sequence[float], segments: int
         ) -> np.ndarray:
    """Return a pipe of 2 x (p - 1) x segments triangles along a path of (p, 3) points."""
    path = np.asarray(path, np.float64)
    ahead = np.gradient(path, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    helper = np.eye(3)[np.abs(ahead).sum(axis=0).argmin()]
    side = np.cross(ahead, helper)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    over = np.cross(side, ahead)
    angle = np.linspace(0, 2 * np.pi, segments + 1)
    angle[-1] = 0
    radius = np.broadcast_to(np.asarray(radius, np.float64), len(path))[:, None, None]
    ring = np.cos(angle)[:, None] * side[:, None] + np.sin(angle)[:, None] * over[:, None]
    return patch(path[:, None] + radius * ring)


def place(triangles: np.ndarray, positions: np.ndarray, yaw: np.ndarray | float = 0.0,
          scale: np.ndarray | float = 1.0) -> np.ndarray:
    """Return m copies of k triangles, (m * k, 3, 3), scaled, rotated around y, and moved.

    Parameters
    ----------
    triangles : (k, 3, 3)
    positions : (m, 3), world units
    yaw : (m,) or a number, radians
    scale : (m,) or a number, the same for all axes; or (m, 3)
    """
    m = len(positions)
    yaw = np.broadcast_to(yaw, m)[:, None, None]
    scale = np.asarray(scale, np.float64)
    scale = np.broadcast_to(scale if scale.ndim == 2 else scale[..., None], (m, 3))
    x, y, z = np.moveaxis(triangles[None] * scale[:, None, None], -1, 0)
    turned = np.stack((x * np.cos(yaw) + z * np.sin(yaw), y, z * np.cos(yaw) - x * np.sin(yaw)),
                      axis=-1)
    return (turned + np.asarray(positions)[:, None, None]).reshape(-1, 3, 3)


def noise(points: np.ndarray, wavelength: float, seed: int) -> np.ndarray:
    """Return smooth noise, in about [-1, 1], at points (..., 3). Equal points get equal noise."""
    rng = np.random.default_rng(seed)
    waves = rng.normal(size=(3, 12))
    waves *= 2 * np.pi / wavelength * rng.uniform(0.5, 1.2, 12) / np.linalg.norm(waves, axis=0)
    phases = points @ waves
    phases += rng.uniform(0, 2 * np.pi, 12)
    return np.sin(phases, out=phases).sum(axis=-1) / 3


def bump(triangles: np.ndarray, height: float, wavelength: float, seed: int = 0) -> np.ndarray:
    """Return triangles with vertices displaced by smooth noise; equal vertices stay equal."""
    moves = threads(len(triangles))(lambda axis: noise(triangles, wavelength, seed + axis),
                                    range(3))
    return triangles + height * np.stack(tuple(moves), axis=-1)


def divide(triangles: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Split triangles until there are exactly `count`. Return the new triangles, and the index of
    each new triangle's original.

    Split the largest triangles in three at their centroid, so that no edge is divided. If the
    number to add is odd, cut one more triangle in two at the middle of its longest edge.
    """
    extra = count - len(triangles)
    if not 0 <= extra <= 2 * len(triangles) - 1:
        raise ValueError(f"{len(triangles)} triangles cannot be divided into {count}")
    area = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0],
                                   triangles[:, 2] - triangles[:, 0]), axis=1)
    order = np.argsort(-area, kind="stable")
    thirds, halves = order[:extra // 2], order[extra // 2:extra // 2 + extra % 2]
    a, b, c = triangles[thirds].transpose(1, 0, 2)
    middle = (a + b + c) / 3
    whole = np.sort(order[extra // 2 + extra % 2:])
    long = np.argmax(np.linalg.norm(np.roll(triangles[halves], -1, 1) - triangles[halves],
                                    axis=2), axis=1)
    k = np.arange(len(halves))
    d, e, f = (triangles[halves][k, (long + i) % 3] for i in range(3))
    g = (d + e) / 2
    parts = [triangles[whole]]
    parts += [np.stack(t, axis=1) for t in ((a, b, middle), (b, c, middle), (c, a, middle),
                                            (d, g, f), (g, e, f))]
    origin = np.concatenate((whole, thirds, thirds, thirds, halves, halves))
    sorted_by_origin = np.argsort(origin, kind="stable")
    return np.concatenate(parts)[sorted_by_origin], origin[sorted_by_origin]
