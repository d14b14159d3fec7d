"""Triangle table: makes the scene's box, and the triangle table of most methods."""
from __future__ import annotations

import numpy as np

from ..gl.lazy_field import Column
from ..gl.record import Record

TRIANGLE = Record("triangle", "v0:vec3 index:int | v1:vec3 last:int | v2:vec3")
"""A triangle. ``index`` is its row in the scene; ``last`` is 1 for the last triangle of a leaf."""

REFERENCE = Record("reference", "triangle:pointer")
"""An entry of the triangle list of a leaf or a cell: a pointer to the triangle. A cell's list ends
in the sentinel -1."""


def triangle_table(triangles: np.ndarray, order: np.ndarray | None = None,
                   last: np.ndarray | None = None
                   ) -> dict[str, dict[str, np.ndarray | Column]]:
    """Return the TRIANGLE table of (n, 3, 3) float32 triangles.

    Parameters
    ----------
    order : the index of each row's triangle; None for the order of ``triangles``
    last : for each row, 1 for the last triangle of a leaf, else 0; None omits the field
    """
    index = np.arange(len(triangles)) if order is None else order
    corners = np.ascontiguousarray(triangles).reshape(-1, 3)

    def corner(k: int) -> Column:
        return Column(len(index), lambda rows: corners.take(3 * index[rows] + k, axis=0))
    fields = {"v0": corner(0), "v1": corner(1), "v2": corner(2), "index": index}
    if last is not None:
        fields["last"] = last
    return {TRIANGLE.name: fields}


def box_uniforms(triangles: np.ndarray) -> dict[str, tuple[float, ...]]:
    """Return as uniforms the lowest and the highest corner of the box of (n, 3, 3) triangles.
    Without triangles, both corners are the origin."""
    corners = triangles.reshape(-1, 3) if len(triangles) else np.zeros((1, 3), np.float32)
    return {"scene_lo": tuple(corners.min(0).tolist()), "scene_hi": tuple(corners.max(0).tolist())}
