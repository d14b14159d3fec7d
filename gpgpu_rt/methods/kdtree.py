"""kd-restart and kd-backtrack: stackless kd-tree traversal (Foley and Sugerman 2005)."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .. import accel
from ..options import Option
from ..texel_layout import KD_BOUNDS, KD_NODE, REFERENCE, TRIANGLE, Record
from .brute_force import triangle_table
from .row import Accelerator, Method


def _prepare(triangles: np.ndarray, options: Mapping[str, Any], backtrack: bool) -> Accelerator:
    build = {option.name: options[option.name] for option in _BUILD_OPTIONS}
    tree = accel.cached(accel.build_kdtree, triangles, **build)
    tables = {**triangle_table(triangles),
              KD_NODE.name: {"split": tree.split, "axis": tree.axis, "left": tree.left,
                             "count": tree.count},
              REFERENCE.name: {"triangle": tree.references}}
    if backtrack:
        lo, hi = tree.boxes()
        tables[KD_BOUNDS.name] = {"lo": lo, "hi": hi, "parent": tree.parents()}
    uniforms = {"scene_lo": tuple(tree.lo), "scene_hi": tuple(tree.hi)}
    # Every leaf is entered at most once, after a descent from the root and a climb back to it.
    leaves = int((tree.axis == 3).sum())
    bound = leaves * (2 * tree.depth + 3) + len(tree.references)
    return Accelerator(tables, uniforms, bound, tree)


_BUILD_OPTIONS = (
    Option("split", "binned", "where split planes are tried", choices=("binned", "exact")),
    Option("traversal_cost", 1.0, "cost of a node, for the surface area heuristic", float,
           minimum=0),
    Option("intersection_cost", 2.0, "cost of a triangle, in the same unit", float, minimum=1e-6),
    Option("empty_bonus", 0.2, "share of its cost that a split is spared when it cuts off a fifth "
           "or more as empty", float, minimum=0),
    Option("max_depth", None, "deepest leaf; none: 8 + 1.3 log2 of the triangles", int, minimum=0),
)


_NOT_EXACT = ("strict", "nudge-relative", "nudge-absolute")
_INTERVAL = (
    Option("interval", "exact", "where a ray takes up its interval after a leaf: exactly at its "
           "end, or as others do it", choices=("exact", *_NOT_EXACT), define="INTERVAL",
           relaxed=_NOT_EXACT),
)


def _row(name: str, summary: str, backtrack: bool) -> Method:
    return Method(
        name=name, summary=summary, citation="Foley and Sugerman 2005",
        glsl=f"traverse/{name.replace('-', '_')}.glsl",
        kernels=("down", "intersect") + (("climb",) if backtrack else ()),
        state=Record("state", "t_min t_max t_exit node:int "
                              "| cursor:int end:int phase:int steps:int"),
        tables=(TRIANGLE, KD_NODE, REFERENCE) + ((KD_BOUNDS,) if backtrack else ()),
        prepare=lambda triangles, options: _prepare(triangles, options, backtrack),
        options=_BUILD_OPTIONS + _INTERVAL)


ROWS = (
    _row("kd-restart", "kd-tree, from the root again after each leaf", False),
    _row("kd-backtrack", "kd-tree, up the parents after each leaf", True),
)
