"""Image cells: splits each cell of a geometry image into two triangles.

A chart is a rectangle of texels, and a cell is a quad between 2 x 2 neighbouring texels.
"""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def cell_faces(shapes: Sequence[tuple[int, int]]) -> np.ndarray:
    """Return (n, 3) int64, the texels of each triangle's corners. ``shapes`` gives the (rows,
    columns) of each chart."""
    faces, texel = [np.zeros((0, 3), np.int64)], 0
    for rows, columns in shapes:
        a = (texel + np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1)
        b, c, d = a + 1, a + columns + 1, a + columns
        faces.append(np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3))
        texel += rows * columns
    return np.concatenate(faces)
