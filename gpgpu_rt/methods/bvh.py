"""bvh-threaded: a BVH walked along escape indices (Thrane and Simonsen 2005)."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .. import accel
from ..accel.quantise import quantise
from ..options import Option
from ..texel_layout import (
    BVH_NODE, QUANTISED_NODE_8, QUANTISED_NODE_16, TRIANGLE, PackedRecord, Record
)
from .brute_force import triangle_table
from .row import Accelerator, Method


def _prepare(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    bvh = accel.cached(accel.build_bvh, triangles, build=options["build"])
    nodes = len(bvh.escape)
    last = np.zeros(len(bvh.order), np.int32)
    leaf = bvh.count > 0
    last[(bvh.first + bvh.count)[leaf] - 1] = 1
    table = _octant_nodes(bvh) if options["octants"] else _nodes(bvh)
    bits = options["quantise_nodes"]
    lo, hi = (bvh.lo[0], bvh.hi[0]) if nodes else (np.zeros(3, np.float32),) * 2
    uniforms = {"scene_lo": tuple(lo), "scene_hi": tuple(hi), "node_count": nodes}
    if bits:
        uniforms["quantum"], table = _quantised(table, lo, hi, bits)
    tables = {**triangle_table(triangles, bvh.order, last), _node_record(options).name: table}
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


def _node_record(options: Mapping[str, Any]) -> Record | PackedRecord:
    return {None: BVH_NODE, 16: QUANTISED_NODE_16, 8: QUANTISED_NODE_8}[options["quantise_nodes"]]


def _quantised(table: dict[str, np.ndarray], lo: np.ndarray, hi: np.ndarray,
               bits: int) -> tuple[tuple[float, ...], dict[str, np.ndarray]]:
    """Step of the bounds, and the node table in such steps, as QUANTISED_NODE declares it."""
    quantum, corners = quantise(np.minimum(table["lo"], table["hi"]),
                                np.maximum(table["lo"], table["hi"]), lo, hi, bits)
    swapped = table["lo"] > table["hi"]   # an octant's corners, in the order rays meet them
    first, second = (np.where(swapped, a, b) for a, b in (corners[::-1], corners))
    leaf, end = table["first"] >= 0, table["escape"] < 0
    fields = {"leaf": leaf, "last": end,
              "target": np.where(leaf, table["first"], np.where(end, 0, table["escape"]))}
    for axis, letter in enumerate("xyz"):
        fields["lo_" + letter], fields["hi_" + letter] = first[:, axis], second[:, axis]
    return tuple(quantum), fields


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
        Option("quantise_nodes", None, "bits a bound, rounded outward: the same hits from smaller "
               "nodes", int, choices=(8, 16), optional=True, define="QUANTISED_NODES"),
    ),
    choose_tables=lambda options: (TRIANGLE, _node_record(options)),
),)
