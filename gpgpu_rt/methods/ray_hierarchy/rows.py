"""ray-hierarchy: a hierarchy of spheres and cones over the rays, not over the triangles."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...options import Option
from ...traversal.accelerator import Accelerator
from ...traversal.method import Method, nothing_kept
from ...traversal.records import STATE
from ...traversal.triangle_table import TRIANGLE, box_uniforms, triangle_table
from .driver import RayHierarchy

MOST_BITS = 100     # limit on the scale's exponent, so that scaled values fit a float


def _prepare(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    return Accelerator(triangle_table(triangles),
                       {"unit": unit_of(triangles), **box_uniforms(triangles)},
                       step_bound=len(triangles))


def unit_of(triangles: np.ndarray) -> float:
    """Return the power of two that scales the scene's size to about 1."""
    extent = np.float64(0)
    if len(triangles):
        corners = triangles.reshape(-1, 3)
        extent = (corners.max(axis=0).astype(np.float64) - corners.min(axis=0)).max()
    exponent = int(np.clip(np.frexp(extent)[1], -MOST_BITS, MOST_BITS))
    return float(np.ldexp(1.0, -exponent))


FAMILY = "hierarchy of rays"
ROWS = (Method(
    name="ray-hierarchy",
    summary="builds cones over the rays and reduces a stream of (triangle, cone) pairs, level by "
            "level",
    citation="Roger, Assarsson and Holzschuch 2007",
    glsl="methods/ray_hierarchy/ray_hierarchy.glsl",
    kernels=("intersect",),
    state=STATE,
    tables=(TRIANGLE,),
    prepare=_prepare,
    refit=nothing_kept(_prepare),
    options=(
        Option("stream_size", 1 << 16, "number of pairs of a triangle and a node that are tested "
               "together", int, minimum=1, label="pairs per pass"),
        Option("first_batch", 64, "number of triangles tested before the hierarchy is first "
               "rebuilt; each further batch is four times as large", int, minimum=1,
               label="first triangles tested"),
        Option("top_nodes", 4, "largest number of nodes in the level where the stream begins", int,
               minimum=1, label="nodes at the top")),
    schedules=("kernels",),
    drivers={"kernels": RayHierarchy},
    dynamic=True,
),)
