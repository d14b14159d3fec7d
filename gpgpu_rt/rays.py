"""Rays: the kinds that tests and figures trace, (n, 3) float32 origins and directions; and where
rays that leave a hit start."""
from __future__ import annotations

from typing import Any

import numpy as np

from .errors import OptionError, SceneError, nearest_names
from .hits import Hits
from .reference.error_bounds import FLOAT32, gamma
from .reference.watertight import intersect_pairs

Rays = tuple[np.ndarray, np.ndarray]

_SPAWN_TRIES = 24                                # from _SEEN of a triangle's extent to all of it
_SEEN = np.float32(8 * FLOAT32.unit)


def eye_rays(scene: Any, n: int) -> Rays:
    """The camera's rays through a square image of `n` pixels, row by row from the top.

    Raises OptionError where n is no square.
    """
    side = round(np.sqrt(max(n, 0)))
    if side * side != n or n < 1:
        raise OptionError(f"{n} eye rays make no square image; give a square such as "
                          f"{max(side, 1) ** 2}")
    origins, directions = scene.camera.rays((side, side))
    return origins.reshape(-1, 3), directions.reshape(-1, 3)


def random_rays(scene: Any, n: int, seed: int) -> Rays:
    """Origins uniform in the scene's box, directions uniform on the sphere."""
    rng = np.random.default_rng(seed)
    lo, hi = (corner.astype(np.float64) for corner in scene.bounds)
    origins = lo + (hi - lo) * rng.random((n, 3))
    return origins.astype(np.float32), _unit(rng.normal(size=(n, 3))).astype(np.float32)


def surface_rays(scene: Any, n: int, seed: int) -> Rays:
    """Rays that leave the surface: directions uniform on the hemisphere of the face's normal,
    origins 1e-3 of the extent along them off points uniform by area."""
    rng = np.random.default_rng(seed)
    triangles = np.asarray(scene.triangles, np.float64)
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(normal, axis=1)
    if not area.any():
        raise SceneError(f"{scene.name}: no triangle has an area for rays to leave from; "
                         "give a scene with a surface")
    chosen = rng.choice(len(triangles), n, p=area / area.sum())
    u, v = rng.random((2, n, 1))
    u, v = np.where(u + v > 1, (1 - u, 1 - v), (u, v))
    v0, v1, v2 = triangles[chosen].transpose(1, 0, 2)
    directions = _unit(rng.normal(size=(n, 3)))
    away = (directions * normal[chosen]).sum(axis=1, keepdims=True) < 0
    directions = np.where(away, -directions, directions)
    origins = (1 - u - v) * v0 + u * v1 + v * v2 + 1e-3 * scene.extent * directions
    return origins.astype(np.float32), directions.astype(np.float32)


def aimed_rays(scene: Any, n: int, seed: int, at: str = "vertices",
               origin: np.ndarray | None = None) -> Rays:
    """Rays aimed at vertices or at points on edges, where an intersection test leaks.

    Parameters
    ----------
    at : "vertices" or "edges"
    origin : (3,), where all rays start; by default uniform in the middle half of the box
    """
    if at not in ("vertices", "edges"):
        raise OptionError(f"rays aimed at {at!r}{nearest_names(at, ('vertices', 'edges'))}")
    if not len(scene.triangles):
        raise SceneError(f"{scene.name}: no triangles to aim rays at; give a scene with some")
    rng = np.random.default_rng(seed)
    triangles = np.asarray(scene.triangles, np.float64)
    chosen, corner = rng.integers(len(triangles), size=n), rng.integers(3, size=n)
    aim = triangles[chosen, corner]
    if at == "edges":
        aim = aim + rng.random((n, 1)) * (triangles[chosen, (corner + 1) % 3] - aim)
    if origin is None:
        lo, hi = (side.astype(np.float64) for side in scene.bounds)
        start = lo + (hi - lo) * rng.uniform(0.25, 0.75, (n, 3))
    else:
        start = np.broadcast_to(np.asarray(origin, np.float64), (n, 3))
    start = start.astype(np.float32)
    return start, _unit(aim - start).astype(np.float32)


def spawn(scene: Any, hits: Hits, directions: np.ndarray) -> np.ndarray:
    """Origins from which rays leave hits without hitting what they leave.

    A ray starts beside its hit's triangle, on the side it goes to, by the error of the hit point
    and that with which the watertight test sees the triangle in float32. Long thin triangles are
    seen with larger errors: there the test itself is asked and the distance doubled while it says
    that the ray hits its own triangle, up to the triangle's extent. ``glsl/common/spawn.glsl``
    derives the distance.

    Parameters
    ----------
    scene : Scene, or (m, 3, 3) triangles, world units
    hits : of n rays
    directions : (n, 3), where the new rays go; rounded to float32

    Returns
    -------
    (n, 3) float32, NaN where there was no hit: tracing such rays takes ``invalid="miss"``
    """
    triangles = np.asarray(getattr(scene, "triangles", scene), np.float32)
    directions = np.asarray(directions, np.float32)
    if directions.shape != (len(hits), 3):
        raise ValueError(f"directions have shape {directions.shape}; give ({len(hits)}, 3), one a "
                         "hit")
    origins = np.full((len(hits), 3), np.nan, np.float32)
    some = np.flatnonzero(hits.hit & np.isfinite(directions).all(1) & (directions != 0).any(1))
    corners, leaving = triangles[hits.triangle[some]], directions[some]
    u, v = (np.asarray(b, np.float32)[some, None] for b in (hits.u, hits.v))
    point, error, reach = _hit_points(corners, u, v)
    normal = unit_normals(corners)
    with np.errstate(over="ignore"):
        away = (normal.astype(np.float64) * leaving).sum(axis=1, keepdims=True) < 0
        normal = np.where(away, -normal, normal)
        distance = (np.abs(normal) * error).sum(axis=1, keepdims=True) + _SEEN * reach
        rest = np.arange(len(some))
        for _ in range(_SPAWN_TRIES):
            start = point[rest] + normal[rest] * distance[rest]
            origins[some[rest]] = start
            accepted, t, _, _ = intersect_pairs(corners[rest], start, leaving[rest])
            rest = rest[accepted & (t >= 0) & (2 * distance[rest] <= reach[rest])[:, 0]]
            if not len(rest):
                break
            distance[rest] *= np.float32(2)
    return origins


def _hit_points(corners: np.ndarray, u: np.ndarray, v: np.ndarray
                ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (k, 3) of triangles at u, v (k, 1), all float32; how far each component is off,
    and how far along any axis the furthest corner is, (k, 1)."""
    unit = np.float32(FLOAT32.unit)
    v0, v1, v2 = corners.transpose(1, 0, 2)
    parts = (np.float32(1) - u - v) * v0, u * v1, v * v2
    point = parts[0] + parts[1] + parts[2]
    error = np.float32(gamma(8)) * sum(np.abs(p) for p in parts) + unit * np.abs(v0)
    reach = np.abs(corners - point[:, None]).max(axis=(1, 2))[:, None]
    return point, error, reach


def unit_normals(corners: np.ndarray) -> np.ndarray:
    """(k, 3) float32 unit normals of triangles (k, 3, 3)."""
    v0, v1, v2 = corners.astype(np.float64).transpose(1, 0, 2)
    return _unit(np.cross(v1 - v0, v2 - v0)).astype(np.float32)


def _unit(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(length > 0, vectors / np.where(length > 0, length, 1), (0.0, 0.0, 1.0))
