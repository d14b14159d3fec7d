"""Ray sets: makes the rays that tests and figures trace, as (n, 3) float32 arrays."""
from __future__ import annotations

from typing import Any

import numpy as np

from ..accel.bounds import unit_vectors
from ..errors import OptionError, SceneError, nearest_names

Rays = tuple[np.ndarray, np.ndarray]


def eye_rays(scene: Any, n: int) -> Rays:
    """Return the camera's rays through a square image of `n` pixels, row by row from the top.

    Raises OptionError if n is not a square number.
    """
    side = round(np.sqrt(max(n, 0)))
    if side * side != n or n < 1:
        raise OptionError(f"{n} eye rays make no square image; give a square such as "
                          f"{max(side, 1) ** 2}")
    origins, directions = scene.camera.rays((side, side))
    return origins.reshape(-1, 3), directions.reshape(-1, 3)


def random_rays(scene: Any, n: int, seed: int) -> Rays:
    """Return rays with origins uniform in the scene's box and directions uniform on the sphere."""
    rng = np.random.default_rng(seed)
    lo, hi = (corner.astype(np.float64) for corner in scene.bounds)
    origins = lo + (hi - lo) * rng.random((n, 3))
    return origins.astype(np.float32), unit_vectors(rng.normal(size=(n, 3))).astype(np.float32)


def surface_rays(scene: Any, n: int, seed: int) -> Rays:
    """Return rays that leave the surface from points that are uniform by area.

    Directions are uniform on the hemisphere around the triangle's normal. Origins lie 1e-3 of the
    scene's extent away from the surface, along the direction.

    Raises SceneError if no triangle has an area.
    """
    rng = np.random.default_rng(seed)
    triangles = np.asarray(scene.triangles, np.float64)
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(normal, axis=1)
    if not area.any():
        raise SceneError(f"{scene.name}: every triangle has area 0, so no ray can start on the "
                         "surface; give a scene with a surface")
    chosen = rng.choice(len(triangles), n, p=area / area.sum())
    u, v = rng.random((2, n, 1))
    u, v = np.where(u + v > 1, (1 - u, 1 - v), (u, v))
    v0, v1, v2 = triangles[chosen].transpose(1, 0, 2)
    directions = unit_vectors(rng.normal(size=(n, 3)))
    away = (directions * normal[chosen]).sum(axis=1, keepdims=True) < 0
    directions = np.where(away, -directions, directions)
    origins = (1 - u - v) * v0 + u * v1 + v * v2 + 1e-3 * scene.extent * directions
    return origins.astype(np.float32), directions.astype(np.float32)


def aimed_rays(scene: Any, n: int, seed: int, at: str = "vertices",
               origin: np.ndarray | None = None) -> Rays:
    """Return rays aimed at vertices or at points on edges, where intersection tests may miss.

    Parameters
    ----------
    scene : Scene
    n : number of rays
    seed : the seed of the random numbers
    at : "vertices" or "edges"
    origin : (3,), shared by all rays; by default, uniform in the middle half of each axis of the
        scene's box

    Raises
    ------
    OptionError
        for another ``at``
    SceneError
        for a scene without triangles
    """
    if at not in ("vertices", "edges"):
        raise OptionError(f"cannot aim rays at {at!r}{nearest_names(at, ('vertices', 'edges'))}")
    if not len(scene.triangles):
        raise SceneError(f"{scene.name}: no triangles to aim rays at; give a scene with "
                         "triangles")
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
    return start, unit_vectors(aim - start).astype(np.float32)
