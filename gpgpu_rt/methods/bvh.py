"""The BVH family: one tree, threaded, or with a stack that a packet shares."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .. import accel
from ..accel.quantise import quantise
from ..options import Option
from ..texel_layout import (
    BVH_NODE, BVH_PAIR, QUANTISED_NODE_8, QUANTISED_NODE_16, QUANTISED_PAIR_8, QUANTISED_PAIR_16,
    TRIANGLE, PackedRecord, Record
)
from .brute_force import triangle_table
from .bvh_build import BUILD_OPTIONS, built_bvh
from .row import PACKET, Accelerator, Method


def _built(triangles: np.ndarray, options: Mapping[str, Any]) -> tuple[accel.Bvh, np.ndarray]:
    """The tree, and for each place in its order whether a leaf's run ends there."""
    bvh = built_bvh(triangles, options)
    last = np.zeros(len(bvh.order), np.int32)
    leaf = bvh.count > 0
    last[(bvh.first + bvh.count)[leaf] - 1] = 1
    return bvh, last


def _corners(bvh: accel.Bvh) -> tuple[np.ndarray, np.ndarray]:
    """The scene's box, (3,) float32 each, world units."""
    return (bvh.lo[0], bvh.hi[0]) if len(bvh.lo) else (np.zeros(3, np.float32),) * 2


def _prepare(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    bvh, last = _built(triangles, options)
    nodes = len(bvh.escape)
    table, swapped = _octant_nodes(bvh) if options["octants"] else (_nodes(bvh), False)
    bits = options["quantise_nodes"]
    lo, hi = _corners(bvh)
    uniforms: dict[str, Any] = {"scene_lo": tuple(lo), "scene_hi": tuple(hi), "node_count": nodes}
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
    leaf, end = table["first"] >= 0, table["escape"] < 0
    return tuple(quantum), {
        "leaf": leaf, "last": end,
        "target": np.where(leaf, table["first"], np.where(end, 0, table["escape"])),
        **_by_axis("", *_swap(swapped, *corners))}


def _quantised_pairs(table: dict[str, np.ndarray], lo: np.ndarray, hi: np.ndarray,
                     bits: int) -> tuple[tuple[float, ...], dict[str, np.ndarray]]:
    """Step of the bounds, and the table of pairs in such steps, as QUANTISED_PAIR declares it."""
    fields: dict[str, np.ndarray] = {}
    for side in ("left", "right"):
        quantum, corners = quantise(table[f"{side}_lo"], table[f"{side}_hi"], lo, hi, bits)
        child = table[side]
        fields |= {side: np.where(child < 0, -1 - child, child), f"{side}_leaf": child < 0,
                   **_by_axis(side + "_", *corners)}
    return tuple(quantum), fields


def _by_axis(prefix: str, lo: np.ndarray, hi: np.ndarray) -> dict[str, np.ndarray]:
    return {f"{prefix}{end}_{letter}": corner[:, axis] for end, corner in (("lo", lo), ("hi", hi))
            for axis, letter in enumerate("xyz")}


def _pair_record(options: Mapping[str, Any]) -> Record | PackedRecord:
    return {None: BVH_PAIR, 16: QUANTISED_PAIR_16,
            8: QUANTISED_PAIR_8}[options["quantise_nodes"]]


def _prepare_pairs(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    """Inner nodes with both children's boxes, and the stack that suffices for the tree."""
    bvh, last = _built(triangles, options)
    left, right = bvh.children()
    inner = left >= 0
    link = np.where(inner, np.cumsum(inner) - 1, -1 - bvh.first)
    left, right = left[inner], right[inner]
    table = {"left": link[left], "right": link[right], "left_lo": bvh.lo[left],
             "left_hi": bvh.hi[left], "right_lo": bvh.lo[right], "right_hi": bvh.hi[right]}
    nodes = len(link)
    lo, hi = _corners(bvh)
    uniforms = {"scene_lo": tuple(lo), "scene_hi": tuple(hi), "node_count": nodes,
                "root": int(link[0]) if nodes else 0}
    if bits := options["quantise_nodes"]:
        uniforms["quantum"], table = _quantised_pairs(table, lo, hi, bits)
    tables = {**triangle_table(triangles, bvh.order, last), _pair_record(options).name: table}
    return Accelerator(tables, uniforms, step_bound=nodes + len(bvh.order), structure=bvh,
                       defines={"STACK_SIZE": max(1, bvh.depth)})


def _prepare_packet(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    prepared = (_prepare if options["octants"] else _prepare_pairs)(triangles, options)
    prepared.step_bound *= options["packet"][0] * options["packet"][1]
    return prepared


_OCTANTS = Option("octants", False, "eight copies threaded front to back, one a direction octant",
                  bool, define="OCTANTS")
_QUANTISE = Option("quantise_nodes", None, "bits a bound, rounded outward: the same hits from "
                   "smaller nodes", int, choices=(8, 16), optional=True, define="QUANTISED_NODES")
_INTERVAL_TEST = Option("interval_test", False, "one test of a box for all rays of a packet, by "
                        "interval arithmetic", bool, define="INTERVAL_TEST")


def _stack_row(name: str, summary: str, **more: Any) -> Method:
    """A row of Guenther's method: its state is what single rays are left with."""
    return Method(
        name=name, summary=summary, citation="Guenther et al. 2007",
        glsl="traverse/bvh_packet.glsl", kernels=("step_packet",),
        state=Record("state", "phase:int steps:int"), tables=(TRIANGLE, BVH_PAIR),
        schedules=("loop",), single="bvh-threaded", stack=True, **more)


ROWS = (
    Method(
        name="bvh-threaded",
        summary="BVH in depth-first order, escape indices instead of a stack",
        citation="Thrane and Simonsen 2005",
        glsl="traverse/bvh_threaded.glsl",
        kernels=("traverse", "intersect"),
        state=Record("state", "node:int cursor:int phase:int steps:int"),
        tables=(TRIANGLE, BVH_NODE),
        prepare=_prepare,
        options=(*BUILD_OPTIONS, _OCTANTS, _QUANTISE),
        choose_tables=lambda options: (TRIANGLE, _node_record(options))),
    _stack_row(
        "bvh-stack", "BVH with a stack a ray, in a local array, the nearer child first",
        prepare=_prepare_pairs, options=(*BUILD_OPTIONS, _QUANTISE),
        choose_tables=lambda options: (TRIANGLE, _pair_record(options))),
    _stack_row(
        "bvh-packet", "several rays a fragment with one stack, the child first that most meet",
        prepare=_prepare_packet, options=(
            *BUILD_OPTIONS, PACKET, _OCTANTS, _QUANTISE, _INTERVAL_TEST),
        choose_tables=lambda options: (
            TRIANGLE, (_node_record if options["octants"] else _pair_record)(options)),
        packet=True),
)
