"""ray-tiles: test every triangle against cones around tiles of rays (Szécsi 2006)."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...options import Option
from ...traversal.accelerator import Accelerator
from ...traversal.method import Method, nothing_kept
from ...traversal.records import STATE
from ...traversal.triangle_table import TRIANGLE, box_uniforms, triangle_table
from .driver import RayTiles

FIRST_BATCH = 64    # triangles of the first batch; each next batch is twice as large


def batches(triangles: int) -> tuple[tuple[int, int], ...]:
    """Return the first triangle and the number of triangles of each batch.

    Between two batches, a pass shortens the search of each tile's rays. Small first batches
    shorten searches early.
    """
    found, first, count = [], 0, FIRST_BATCH
    while first < triangles:
        found.append((first, min(count, triangles - first)))
        first, count = first + count, 2 * count
    return tuple(found)


def _prepare(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    parts = batches(len(triangles))
    return Accelerator(triangle_table(triangles), box_uniforms(triangles), step_bound=len(parts),
                       structure=parts)


FAMILY = "tiles of rays"
ROWS = (Method(
    name="ray-tiles",
    summary="draws each triangle over the tiles of rays whose cone the triangle meets; builds no "
            "structure over triangles",
    citation="Szécsi 2006",
    glsl="methods/ray_tiles/cone.glsl",
    kernels=("draw",),
    state=STATE,
    tables=(TRIANGLE,),
    prepare=_prepare,
    refit=nothing_kept(_prepare),
    options=(
        Option("tile", 8, "side of a tile, in rays", int, choices=(8, 4, 16),
               label="rays along a tile"),
        Option("pairs", "points", "primitive that is drawn over a tile for a triangle: a point as "
               "large as the tile, or a quad", choices=("points", "quads"),
               label="primitive per tile")),
    schedules=("kernels",),
    drivers={"kernels": RayTiles},
    dynamic=True,
),)
