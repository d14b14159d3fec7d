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
from .bvh_build import BUILD_OPTIONS, built_bvh
from .row import Accelerator, Method


def _prepare(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    bvh = built_bvh(triangles, options)
    nodes = len(bvh.escape)
    last = np.zeros(len(bvh.order), np.int32)
    leaf = bvh.count > 0
    last[(bvh.first + bvh.count)[leaf] - 1] = 1
    table, swapped = _octant_nodes(bvh) if options["octants"] else (_nodes(bvh), False)
    bits = options["quantise_nodes"]
    lo, hi = (bvh.lo[0], bvh.hi[0]) if nodes else (np.zeros(3, np.float32),) * 2
    uniforms = {"scene_lo": tuple(lo), "scene_hi": tuple(hi), "node_count": nodes}
    if bits:
        uniforms["quantum"], table = _quantised(table, swapped, lo, hi, bits)
    else:
        table["lo"], table["hi"] = _swap(swapped, table["lo"], table["hi"])
    tables = {**triangle_table(triangles, bvh.order, last), _node_record(options).name: table}
    return Accelerator(tables, uniforms, step_bound=nodes + len(bvh.order), structure=bvh)


def _links(escape: np.ndarray, first: np.ndarray, count: np.ndarray,
           base: int) -> dict[str, np.ndarray]:
    """Links of a tree whose nodes begin at ``base``: -1 ends the walk, and marks inner nodes."""
    return {"escape": np.where(escape < len(escape), escape + base, -1),
            "first": np.where(count > 0, first, -1)}


def _nodes(bvh: accel.Bvh) -> dict[str, np.ndarray]:
    return {"lo": bvh.lo, "hi": bvh.hi, **_links(bvh.escape, bvh.first, bvh.count, 0)}


def _octant_nodes(bvh: accel.Bvh) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Eight copies, one a direction octant, and which bounds, (n, 3) bool, its rays meet in
    reverse."""
    copies, nodes = bvh.octant_copies(), len(bvh.escape)
    links = [_links(copies.escape[octant], copies.first[octant], copies.count[octant],
                    octant * nodes) for octant in range(8)]
    negative = np.arange(8)[:, None] >> np.arange(3) & 1 == 1
    return ({"lo": copies.lo.reshape(-1, 3), "hi": copies.hi.reshape(-1, 3),
             **{name: np.concatenate([part[name] for part in links]) for name in links[0]}},
            np.repeat(negative, nodes, axis=0))


def _swap(swapped: np.ndarray | bool, lo: np.ndarray,
          hi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bounds in the order that an octant's rays meet them."""
    return np.where(swapped, hi, lo), np.where(swapped, lo, hi)


def _node_record(options: Mapping[str, Any]) -> Record | PackedRecord:
    return {None: BVH_NODE, 16: QUANTISED_NODE_16, 8: QUANTISED_NODE_8}[options["quantise_nodes"]]


def _quantised(table: dict[str, np.ndarray], swapped: np.ndarray | bool, lo: np.ndarray,
               hi: np.ndarray, bits: int) -> tuple[tuple[float, ...], dict[str, np.ndarray]]:
    """Step of the bounds, and the node table in such steps, as QUANTISED_NODE declares it."""
    # Swapped only here: a box without thickness has some once its bounds are rounded outward.
    quantum, corners = quantise(table["lo"], table["hi"], lo, hi, bits)
    first, second = _swap(swapped, *corners)
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
        *BUILD_OPTIONS,
        Option("octants", False, "eight copies threaded front to back, one a direction octant",
               bool, define="OCTANTS"),
        Option("quantise_nodes", None, "bits a bound, rounded outward: the same hits from smaller "
               "nodes", int, choices=(8, 16), optional=True, define="QUANTISED_NODES"),
    ),
    choose_tables=lambda options: (TRIANGLE, _node_record(options)),
),)
