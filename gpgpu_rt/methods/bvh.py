"""bvh-threaded: a BVH walked along escape indices (Thrane and Simonsen 2005)."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .. import accel
from ..options import Option
from ..texel_layout import BVH_NODE, TRIANGLE, Record
from .brute_force import triangle_table
from .row import Accelerator, Method


def _prepare(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    bvh = accel.cached(accel.build_bvh, triangles, build=options["build"])
    nodes = len(bvh.escape)
    last = np.zeros(len(bvh.order), np.int32)
    leaf = bvh.count > 0
    last[(bvh.first + bvh.count)[leaf] - 1] = 1
    table = _octant_nodes(bvh) if options["octants"] else _nodes(bvh)
    lo, hi = (bvh.lo[0], bvh.hi[0]) if nodes else (np.zeros(3, np.float32),) * 2
    uniforms = {"scene_lo": tuple(lo), "scene_hi": tuple(hi), "node_count": nodes}
    tables = {**triangle_table(triangles, bvh.order, last), BVH_NODE.name: table}
    return Accelerator(tables, uniforms, step_bound=nodes + len(bvh.order), structure=bvh)


def _links(escape: np.ndarray, first: np.ndarray, count: np.ndarray,
           base: int) -> dict[str, np.ndarray]:
    """Links of a tree whose nodes begin at ``base``: -1 ends the walk, and marks inner nodes."""
    return {"escape": np.where(escape < len(escape), escape + base, -1),
            "first": np.where(count > 0, first, -1)}


def _nodes(bvh: accel.Bvh) -> dict[str, np.ndarray]:
    return {"lo": bvh.lo, "hi": bvh.hi, **_links(bvh.escape, bvh.first, bvh.count, 0)}


def _octant_nodes(bvh: accel.Bvh) -> dict[str, np.ndarray]:
    """Eight copies, one a direction octant, each box by the corner its rays meet first."""
    copies = bvh.octant_copies()
    parts = []
    for octant in range(8):
        negative = (octant >> np.arange(3)) & 1 == 1
        lo, hi = copies.lo[octant], copies.hi[octant]
        parts.append({"lo": np.where(negative, hi, lo), "hi": np.where(negative, lo, hi),
                      **_links(copies.escape[octant], copies.first[octant],
                               copies.count[octant], octant * len(bvh.escape))})
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


ROWS = (Method(
    name="bvh-threaded",
    summary="BVH in depth-first order, escape indices instead of a stack",
    citation="Thrane and Simonsen 2005",
    glsl="traverse/bvh_threaded.glsl",
    kernels=("traverse", "intersect"),
    state=Record("state", "node:int cursor:int phase:int steps:int"),
    tables=(TRIANGLE, BVH_NODE),
    prepare=_prepare,
    options=(
        Option("build", "sah", "who builds the tree",
               choices=("sah", "kay-kajiya", "goldsmith-salmon")),
        Option("octants", False, "eight copies threaded front to back, one a direction octant",
               bool, define="OCTANTS"),
    ),
),)
