"""Reference picture: the picture that `Tracer.render` draws, with hits and shadows in float64."""
from __future__ import annotations

import numpy as np

from ..scene.light import BACKDROP
from ..scene.scene import Scene
from .nearest import trace

GROUND, OVERHEAD = np.array((0.16, 0.14, 0.12)), np.array((0.26, 0.29, 0.33))


def reference_picture(scene: Scene, size: tuple[int, int]) -> np.ndarray:
    """Return the picture of the scene's own camera, (height, width, 3) float64 sRGB in [0, 1].

    The formulas are those of ``render/surfaces.frag`` and ``render/picture.frag``; a test compares
    the pictures.
    """
    width, height = size
    origins, directions = (a.reshape(-1, 3) for a in scene.camera.rays(size))
    hits = trace(scene, origins, directions, accelerated=True)
    origins, directions = origins.astype(np.float64), directions.astype(np.float64)
    light = BACKDROP.radiance(directions)
    rays = np.flatnonzero(hits.hit)
    if len(rays):
        light[rays] = _surfaces(scene, origins[rays], directions[rays], hits.t[rays],
                                hits.triangle[rays])
    light = np.clip(light, 0, 1)
    return np.where(light < 0.0031308, 12.92 * light,
                    1.055 * light ** (1 / 2.4) - 0.055).reshape(height, width, 3)


def _surfaces(scene: Scene, origins: np.ndarray, directions: np.ndarray, t: np.ndarray,
              triangle: np.ndarray) -> np.ndarray:
    """Return (n, 3), the linear light that n hits reflect towards the eye."""
    corners = scene.triangles[triangle].astype(np.float64)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.where(_dot(normal, directions) > 0, -normal, normal)
    points = origins + t[:, None] * directions
    to_light = np.asarray(scene.light.position) - points
    distance = np.linalg.norm(to_light, axis=1, keepdims=True)
    cosine = np.maximum(_dot(normal, to_light / distance), 0)
    # A ray from the light to the point needs no offset: the first hit is either the point's own
    # triangle or an occluder. A hit at 1 - 1e-5 of the distance or beyond means that the point is
    # lit. This test errs only at grazing angles, where rounding the direction to float32 moves
    # the hit. The surface receives almost no light there.
    back = trace(scene, np.broadcast_to(scene.light.position, points.shape), -to_light,
                 accelerated=True)
    lit = ((back.triangle == triangle) | (back.t >= 1 - 1e-5))[:, None]
    ambient = (GROUND + (OVERHEAD - GROUND) * (0.5 + 0.5 * normal[:, 1:2])) * (
        0.7 + 0.3 * np.maximum(-_dot(normal, directions), 0))
    return scene.colours[triangle] * (ambient + lit * cosine * np.asarray(scene.light.intensity))


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return (n, 1) dot products of (n, 3) vectors."""
    return (a * b).sum(axis=1, keepdims=True)
