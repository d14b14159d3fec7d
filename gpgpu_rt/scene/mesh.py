"""Mesh: the arrays and materials of a mesh file."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..accel.bounds import unit_normals
from .camera import Camera
from .light import Environment, PointLight
from .material import Material


@dataclass
class Mesh:
    """A mesh as its file stores it.

    Attributes
    ----------
    vertices : Positions, (v, 3) float64, world units.
    faces : Indices of vertices, (n, 3) int64, in the file's order.
    colours : Diffuse reflectance, (n, 3) float32 in [0, 1], or None.
    materials : The materials; may be empty.
    material_of : Index of each face's material in ``materials``, (n,) int32.
    normals, uv : Values at the faces' corners, (n, 3, 3) and (n, 3, 2) float64, or None.
    parts : Names of the objects or groups.
    part_of : Index of each face's part in ``parts``, (n,) int32.
    camera, lights, environment : The file's values, or None; () for no lights.
    """

    vertices: np.ndarray
    faces: np.ndarray
    colours: np.ndarray | None
    materials: tuple[Material, ...]
    material_of: np.ndarray
    normals: np.ndarray | None
    uv: np.ndarray | None
    parts: tuple[str, ...]
    part_of: np.ndarray
    camera: Camera | None = None
    lights: tuple[PointLight, ...] = ()
    environment: Environment | None = None

    def appearance(self) -> dict[str, Any]:
        """Return keyword arguments of `Scene.from_arrays`."""
        said: dict[str, Any] = {"normals": self.normals, "uv": self.uv,
                                "lights": self.lights or None, "environment": self.environment}
        if self.materials:
            said.update(materials=self.materials, material_of=self.material_of)
        return {name: value for name, value in said.items() if value is not None}


def fill_normals(mesh: Mesh) -> None:
    """Repair corner values in place: a face that lacks a normal at any corner gets its geometric
    normal at all corners, and texture coordinates that are not finite become zeros."""
    if mesh.normals is not None:
        missing = ~(np.linalg.norm(mesh.normals, axis=2) > 0).all(axis=1)    # true for NaN too
        missing |= ~np.isfinite(mesh.normals).all(axis=(1, 2))
        mesh.normals[missing] = unit_normals(mesh.vertices[mesh.faces[missing]])[:, None]
    if mesh.uv is not None:
        mesh.uv[~np.isfinite(mesh.uv)] = 0


def unlike(materials: Sequence[Material | None]) -> tuple[tuple[Material, ...], np.ndarray]:
    """Return the different materials of a list, and the index of each entry's material in this
    result. If all entries are None, return no materials and zeros."""
    if not any(materials):
        return (), np.zeros(max(len(materials), 1), np.int64)
    place: dict[Material, int] = {}
    rows = [place.setdefault(m or Material(), len(place)) for m in materials]
    return tuple(place), np.array(rows)


def filled(parts: Sequence[np.ndarray | None], sizes: Sequence[int],
           width: int) -> np.ndarray | None:
    """Join the corner values of parts, with zeros for a part without values; None if no part has
    values."""
    if all(part is None for part in parts):
        return None
    return np.concatenate([np.zeros((n, 3, width)) if part is None else part
                           for part, n in zip(parts, sizes)])


def fans(first: np.ndarray, sides: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cut p polygons into n triangles. Return the indices of the triangles' corners, (n, 3), and
    the polygon of each triangle, (n,).

    A quad becomes 0 1 2 and 2 3 0. Any other polygon becomes a fan around corner 0.

    Parameters
    ----------
    first, sides : (p,) int, the index of each polygon's first corner, and its number of corners
    """
    count = np.maximum(sides - 2, 0)
    face = np.repeat(np.arange(len(sides)), count)
    step = np.arange(len(face)) - np.repeat(np.cumsum(count) - count, count)
    at = first[face, None] + np.stack([np.zeros_like(step), step + 1, step + 2], axis=1)
    turned = (sides[face] == 4) & (step == 1)
    at[turned] = at[turned][:, [1, 2, 0]]
    return at, face
