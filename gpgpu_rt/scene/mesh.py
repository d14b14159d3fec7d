"""Mesh: arrays and materials as a file gives them."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..accel.bounds import unit_normals
from .material import Material


@dataclass
class Mesh:
    """A mesh as its file has it.

    Attributes
    ----------
    vertices : (v, 3) float64, world units
    faces : (n, 3) int64, in the file's order
    colours : (n, 3) float32 diffuse in [0, 1], or None where the file has none
    materials : what ``material_of``, (n,) int32, counts; empty where the file has none
    normals, uv : (n, 3, 3) and (n, 3, 2) float64 of the faces' corners, or None
    parts : names of objects or groups, which ``part_of``, (n,) int32, counts
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

    def appearance(self) -> dict[str, Any]:
        """What of it `Scene.from_arrays` takes besides vertices, faces and colours."""
        said: dict[str, Any] = {"normals": self.normals, "uv": self.uv}
        if self.materials:
            said.update(materials=self.materials, material_of=self.material_of)
        return {name: value for name, value in said.items() if value is not None}


def fill_normals(mesh: Mesh) -> None:
    """Give faces without a normal at each corner the triangle's own, and corners whose texture
    coordinates are not finite zeros."""
    if mesh.normals is not None:
        missing = ~(np.linalg.norm(mesh.normals, axis=2) > 0).all(axis=1)    # or not a number
        missing |= ~np.isfinite(mesh.normals).all(axis=(1, 2))
        mesh.normals[missing] = unit_normals(mesh.vertices[mesh.faces[missing]])[:, None]
    if mesh.uv is not None:
        mesh.uv[~np.isfinite(mesh.uv)] = 0


def unlike(materials: Sequence[Material | None]) -> tuple[tuple[Material, ...], np.ndarray]:
    """Materials, each once, and which one each of the list is; none at all if none is known."""
    if not any(materials):
        return (), np.zeros(max(len(materials), 1), np.int64)
    place: dict[Material, int] = {}
    rows = [place.setdefault(m or Material(), len(place)) for m in materials]
    return tuple(place), np.array(rows)


def filled(parts: Sequence[np.ndarray | None], sizes: Sequence[int],
           width: int) -> np.ndarray | None:
    """Values of all corners, zeros where a part has none; None where no part has any."""
    if all(part is None for part in parts):
        return None
    return np.concatenate([np.zeros((n, 3, width)) if part is None else part
                           for part, n in zip(parts, sizes)])
