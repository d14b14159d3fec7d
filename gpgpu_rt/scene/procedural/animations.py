"""Animations: built-in scenes that move, as functions from a frame number to vertex arrays.

A frame depends only on its number, so frames can be made in any order.
"""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..camera import Camera
from . import creatures
from .built import Built
from .shapes import noise
from .walker import walker_at

FRAMES_A_SECOND = 24
CLOTH_CELLS = 158    # cells along a side of the cloth, which gives 49,928 triangles


@dataclass(frozen=True)
class Motion:
    """The motion of a built-in scene.

    vertices : maps a frame number to (v, 3) float32 vertices or (n, 3, 3) triangles, world units
    faces : returns (n, 3) int32 indices of vertices; None if ``vertices`` returns triangles
    """

    vertices: Callable[[int], np.ndarray]
    faces: Callable[[], np.ndarray] | None = None


# Cloth: a height field that waves --------------------------------------------------------------

def cloth_vertices(frame: int) -> np.ndarray:
    """Return ((cells + 1)^2, 3) float32 vertices of a sheet of side 2 with three waves, fixed at
    the edge z = -1."""
    x, z = np.meshgrid(*2 * (np.linspace(-1, 1, CLOTH_CELLS + 1),), indexing="ij")
    t = frame / FRAMES_A_SECOND
    loose = (z + 1) / 2
    y = loose * (0.16 * np.sin(5 * z - 4 * t) + 0.08 * np.sin(7 * x + 3 * z - 5.3 * t)
                 + 0.04 * np.sin(17 * x - 11 * z + 7.1 * t))
    return np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(np.float32)


def cloth_faces() -> np.ndarray:
    """Return (n, 3) int32 vertex indices, two triangles per cell."""
    side = CLOTH_CELLS + 1
    a = (np.arange(CLOTH_CELLS)[:, None] * side + np.arange(CLOTH_CELLS)).reshape(-1)
    b, c, d = a + 1, a + side + 1, a + side
    return np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3).astype(np.int32)


def cloth() -> Built:
    """Return the waving sheet at frame 0: 49,928 triangles in a chequered pattern."""
    triangles = cloth_vertices(0)[cloth_faces()]
    square = np.floor(triangles[:, 0, ::2] * 4).astype(int).sum(axis=1) % 2
    colours = np.where(square[:, None] == 0, (0.62, 0.16, 0.14), (0.78, 0.72, 0.62))
    camera = Camera((-1.9, 1.7, 2.6), (0.0, -0.1, 0.1), fov=48)
    return Built(triangles, colours, camera, (-2.0, 4.0, 1.5),
                 charts=((CLOTH_CELLS + 1, CLOTH_CELLS + 1),))


# Explosion: every triangle on its own -----------------------------------------------------------

def explosion_triangles(frame: int) -> np.ndarray:
    """Return (69,451, 3, 3) float32 triangles: at frame 0 the procedural bunny, which then flies
    apart. Each triangle spins, is slowed by drag, and falls to a floor."""
    start = creatures.bunny().triangles
    if frame == 0:
        return start.astype(np.float32)
    t = frame / FRAMES_A_SECOND
    middle = start.mean(axis=1, keepdims=True)
    away = middle - (0.0, 0.35, 0.0)
    rough = np.stack([noise(middle, 0.5, seed) for seed in (1, 2, 3)], axis=-1)
    speed = 2.2 * away + 0.7 * rough
    angle = 5 * t * noise(middle, 0.2, 4)[..., None]
    spin = np.cross(speed, (0.0, 1.0, 0.0)) + (0.3, 0.1, 0.2)
    spin /= np.linalg.norm(spin, axis=-1, keepdims=True)
    arm = start - middle
    turned = (arm * np.cos(angle) + np.cross(spin, arm) * np.sin(angle)
              + spin * (spin * arm).sum(axis=-1, keepdims=True) * (1 - np.cos(angle)))
    place = middle + speed * (1 - np.exp(-1.5 * t)) / 1.5
    place[..., 1] = np.maximum(place[..., 1] - 0.9 * t ** 2, np.minimum(middle[..., 1], 0.02))
    return (place + turned).astype(np.float32)


def explosion() -> Built:
    """Return the procedural bunny before it flies apart: 69,451 triangles, seen from further away
    than the scene bunny."""
    built = creatures.bunny()
    return replace(built, camera=Camera((-1.1, 1.3, 3.9), (0.0, 0.72, 0.0), fov=36))


# Walker: an animal with joints -----------------------------------------------------------------

def walker_vertices(frame: int) -> np.ndarray:
    """Return the triangles of the animal and the meadow at a frame, (n, 3, 3) float32."""
    return walker_at(frame / FRAMES_A_SECOND)


# The table --------------------------------------------------------------------------------------

MOTIONS = {"cloth": Motion(cloth_vertices, cloth_faces),
           "walker": Motion(walker_vertices),
           "explosion": Motion(explosion_triangles)}
