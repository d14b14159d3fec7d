"""brute-force: every ray against every triangle."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..column import Column
from ..state_layout import LIST_STATE
from ..texel_layout import TRIANGLE
from .row import Accelerator, Method


def triangle_table(triangles: np.ndarray, order: np.ndarray | None = None,
                   last: np.ndarray | None = None
                   ) -> dict[str, dict[str, np.ndarray | Column]]:
    """The TRIANGLE table of (n, 3, 3) float32 triangles, in ``order`` where it is given."""
    index = np.arange(len(triangles)) if order is None else order
    corners = np.ascontiguousarray(triangles).reshape(-1, 3)

    def corner(k: int) -> Column:
        return Column(len(index), lambda rows: corners.take(3 * index[rows] + k, axis=0))
    fields = {"v0": corner(0), "v1": corner(1), "v2": corner(2), "index": index}
    if last is not None:
        fields["last"] = last
    return {TRIANGLE.name: fields}


def box_uniforms(triangles: np.ndarray) -> dict[str, tuple[float, ...]]:
    """The corners of the box around (n, 3, 3) triangles; a point where there are none."""
    corners = triangles.reshape(-1, 3) if len(triangles) else np.zeros((1, 3), np.float32)
    return {"scene_lo": tuple(corners.min(0).tolist()), "scene_hi": tuple(corners.max(0).tolist())}


def _prepare(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    return Accelerator(triangle_table(triangles),
                       {"triangle_count": len(triangles), **box_uniforms(triangles)},
                       step_bound=len(triangles))


ROWS = (Method(
    name="brute-force",
    summary="every ray against every triangle",
    citation="Foley and Sugerman 2005",
    glsl="traverse/brute_force.glsl",
    kernels=("intersect",),
    state=LIST_STATE,
    tables=(TRIANGLE,),
    prepare=_prepare,
),)
