"""bvh-threaded: a BVH walked along escape indices (Thrane and Simonsen 2005)."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import accel
from ..accel.quantise import quantise
from ..column import Column
from ..options import Option
from ..texel_layout import (
    BVH_NODE, QUANTISED_NODE_8, QUANTISED_NODE_16, TRIANGLE, PackedRecord, Record
)
from .brute_force import triangle_table
from .row import Accelerator, Method


@dataclass
class _Layout:
    """What the tables of a tree keep when its boxes change.

    source : (k,) int32, the node that each record of the node table stands for
    links : its escape index and first triangle, (k,) each
    reversed : (k, 3) bool, which bounds a record's rays meet in reverse; None where none is
    last : (m,) int32, 1 where a leaf's run of triangles ends
    refitter : once it was asked for
    """

    source: np.ndarray
    links: dict[str, np.ndarray]
    reversed: np.ndarray | None
    last: np.ndarray
    refitter: accel.Refitter | None = None

    @classmethod
    def of(cls, bvh: accel.Bvh, octants: bool) -> _Layout:
        nodes, last = len(bvh.escape), last_of_leaves(bvh.first, bvh.count, bvh.order)
        if not octants:
            return cls(np.arange(nodes, dtype=np.int32),
                       _links(bvh.escape, bvh.first, bvh.count, 0), None, last)
        copies = bvh.octant_copies()
        links = [_links(copies.escape[octant], copies.first[octant], copies.count[octant],
                        octant * nodes) for octant in range(8)]
        negative = np.arange(8)[:, None] >> np.arange(3) & 1 == 1
        return cls(copies.source.reshape(-1),
                   {name: np.concatenate([part[name] for part in links]) for name in links[0]},
                   np.repeat(negative, nodes, axis=0), last)


def _prepare(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    copies = 8 if options["octants"] else 1
    bvh = accel.cached(accel.build_bvh, triangles, build=options["build"],
                       **accel.node_limit(len(triangles), copies))
    return _accelerator(bvh, _Layout.of(bvh, options["octants"]), triangles, options)


def _refit(accelerator: Accelerator, triangles: np.ndarray,
           options: Mapping[str, Any]) -> Accelerator:
    layout: _Layout = accelerator.kept
    if layout.refitter is None:
        layout.refitter = accel.Refitter.of(accelerator.structure)
    bvh = layout.refitter.refit(accelerator.structure, triangles)
    return _accelerator(bvh, layout, triangles, options)


def _accelerator(bvh: accel.Bvh, layout: _Layout, triangles: np.ndarray,
                 options: Mapping[str, Any]) -> Accelerator:
    nodes, bits = len(bvh.escape), options["quantise_nodes"]
    lo, hi = (bvh.lo[0], bvh.hi[0]) if nodes else (np.zeros(3, np.float32),) * 2
    uniforms = {"scene_lo": tuple(lo), "scene_hi": tuple(hi), "node_count": nodes}
    if bits:
        uniforms["quantum"], table = _quantised(bvh, layout, lo, hi, bits)
    else:
        table = {**layout.links, "lo": _corner(bvh.lo, bvh.hi, layout),
                 "hi": _corner(bvh.hi, bvh.lo, layout)}
    tables = {**triangle_table(triangles, bvh.order, layout.last),
              _node_record(options).name: table}
    return Accelerator(tables, uniforms, step_bound=nodes + len(bvh.order), structure=bvh,
                       kept=layout)


def _corner(met: np.ndarray, other: np.ndarray, layout: _Layout) -> Column:
    """A corner of each record's box: of (n, 3) ``met``, or ``other`` where rays go in reverse."""
    def make(rows: slice) -> np.ndarray:
        source = layout.source[rows]
        return met[source] if layout.reversed is None else np.where(
            layout.reversed[rows], other[source], met[source])
    return Column(len(layout.source), make)


def last_of_leaves(first: np.ndarray, count: np.ndarray, order: np.ndarray) -> np.ndarray:
    """(m,) int32, 1 where a leaf's run of triangles in ``order`` ends."""
    last = np.zeros(len(order), np.int32)
    leaf = count > 0
    last[(first + count)[leaf] - 1] = 1
    return last


def _links(escape: np.ndarray, first: np.ndarray, count: np.ndarray,
           base: int) -> dict[str, np.ndarray]:
    """Links of a tree whose nodes begin at ``base``: -1 ends the walk, and marks inner nodes."""
    return {"escape": np.where(escape < len(escape), escape + base, -1),
            "first": np.where(count > 0, first, -1)}


def _node_record(options: Mapping[str, Any]) -> Record | PackedRecord:
    return {None: BVH_NODE, 16: QUANTISED_NODE_16, 8: QUANTISED_NODE_8}[options["quantise_nodes"]]


def _quantised(bvh: accel.Bvh, layout: _Layout, lo: np.ndarray, hi: np.ndarray,
               bits: int) -> tuple[tuple[float, ...], dict[str, np.ndarray | Column]]:
    """Step of the bounds, and the node table in such steps, as QUANTISED_NODE declares it."""
    # Reversed only here: a box without thickness has some once its bounds are rounded outward.
    quantum, (q_lo, q_hi) = quantise(bvh.lo, bvh.hi, lo, hi, bits)
    leaf, end = layout.links["first"] >= 0, layout.links["escape"] < 0
    fields = {"leaf": leaf, "last": end, "target": np.where(
        leaf, layout.links["first"], np.where(end, 0, layout.links["escape"]))}
    corners = {"lo_": _corner(q_lo, q_hi, layout), "hi_": _corner(q_hi, q_lo, layout)}
    for name, corner in corners.items():
        for axis, letter in enumerate("xyz"):
            fields[name + letter] = Column(len(corner), _component(corner, axis))
    return tuple(quantum), fields


def _component(corner: Column, axis: int) -> Callable[[slice], np.ndarray]:
    return lambda rows: corner[rows][:, axis]


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
        Option("rebuild_ratio", accel.REBUILD_RATIO, "a tree refitted to triangles that moved is "
               "built anew when its SAH cost is so many times that of the last build; 0: always",
               float, minimum=0),
    ),
    refit=_refit,
    choose_tables=lambda options: (TRIANGLE, _node_record(options)),
),)
