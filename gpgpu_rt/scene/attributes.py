"""Attributes: the materials of triangles, and the normals and texture coordinates of corners."""
from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import SceneError
from .material import Material


def material_rows(values: Any, count: int, materials: Sequence[Material], name: str) -> np.ndarray:
    """Return the index of each triangle's material as (count,) int32, after a check. None means
    the first material for all triangles."""
    if not materials:
        raise SceneError(f"{name}: no materials; give at least one")
    if values is None:
        return np.zeros(count, np.int32)
    rows = np.asarray(values)
    if rows.shape != (count,) or (count and rows.dtype.kind not in "iu"):
        raise SceneError(f"{name}: material_of has shape {rows.shape} and type {rows.dtype}; give "
                         f"({count},) whole numbers")
    outside = (rows < 0) | (rows >= len(materials))
    if outside.any():
        first = int(np.argmax(outside))
        raise SceneError(f"{name}: triangle {first} is of material {rows[first]}, but there are "
                         f"{len(materials)} materials; give indices from 0 to "
                         f"{len(materials) - 1}")
    return rows.astype(np.int32)


def corner_values(values: Any, count: int, width: int, name: str,
                  what: str) -> np.ndarray | None:
    """Check the values of triangles' corners and return the values as (count, 3, width) float32;
    None stays None. Values of width 3 are normals and get unit length. A triangle with three zero
    normals is shaded flat."""
    if values is None:
        return None
    try:
        array = np.asarray(values, np.float32)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != (count, 3, width):
        raise SceneError(f"{name}: {what} have shape {array.shape}; give ({count}, 3, {width}), "
                         "one for each corner")
    finite = np.isfinite(array).all(axis=(1, 2))
    if not finite.all():
        raise SceneError(f"{name}: triangle {np.argmin(finite)} has {what} that are not finite; "
                         "repair or drop them")
    if width == 3:
        length = np.linalg.norm(array.astype(np.float64), axis=2, keepdims=True)
        none = (length == 0)[..., 0]
        if (none.any(axis=1) & ~none.all(axis=1)).any():
            first = int(np.argmax(none.any(axis=1) & ~none.all(axis=1)))
            raise SceneError(f"{name}: triangle {first} has a normal without length; repair or "
                             "drop the normals")
        unit = np.abs(length - 1) < 1e-6    # unit normals keep their bits
        array = np.where(unit, array, array / np.where(length > 0, length, 1))
    return np.ascontiguousarray(array, np.float32)


def smooth_normals(triangles: np.ndarray, faces: np.ndarray | None = None) -> np.ndarray:
    """Return (n, 3, 3) float32 normals of corners: at each vertex, the mean of its triangles'
    normals, weighted by the triangles' angles at the vertex (Thuermer and Wuethrich 1998).

    Parameters
    ----------
    triangles : (n, 3, 3)
    faces : (n, 3) int, the vertex of each corner; if None, corners at the same position share a
        vertex
    """
    corners = np.asarray(triangles, np.float64)
    if faces is None:
        places = np.ascontiguousarray(triangles, np.float32).reshape(-1, 3)
        vertex = np.unique(places, axis=0, return_inverse=True)[1].reshape(-1)
    else:
        vertex = np.asarray(faces).reshape(-1)
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat = _unit(flat)
    sides = _unit(np.roll(corners, -1, axis=1) - corners)
    cosine = -(sides * np.roll(sides, 1, axis=1)).sum(axis=2)
    angle = np.arccos(np.clip(cosine, -1, 1))
    weighted = (angle[:, :, None] * flat[:, None]).reshape(-1, 3)
    total = np.stack([np.bincount(vertex, weighted[:, axis]) for axis in range(3)], axis=1)
    normals = _unit(total)[vertex].reshape(corners.shape)
    # Where the weighted normals cancel, use the triangle's own normal, or an arbitrary normal if
    # the triangle has no area.
    normals = np.where(normals.any(axis=2, keepdims=True), normals, flat[:, None])
    normals = np.where(normals.any(axis=2, keepdims=True), normals, (0.0, 0.0, 1.0))
    return normals.astype(np.float32)


def _unit(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(length > 0, vectors / np.where(length > 0, length, 1), 0.0)
