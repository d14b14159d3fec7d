"""bih: the bounding interval hierarchy (Waechter and Keller 2006)."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...accel.cache import cached
from ...options import Option
from ...traversal.accelerator import Accelerator
from ...traversal.leaf_lists import last_of_leaves
from ...traversal.method import Method
from ...traversal.triangle_table import TRIANGLE, triangle_table
from .records import BIH_BOUNDS, BIH_NODE, BIH_STATE
from .tree import LEAF, build_bih

# The root's value of the field `side`; see BIH_BOUNDS.
ROOT = 6


def _prepare(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    bih = cached(build_bih, triangles, max_leaf=options["max_leaf"])
    nodes = len(bih.axis)
    lo, hi = bih.boxes()
    side = np.full(nodes, ROOT)
    inner = np.flatnonzero(bih.axis != LEAF)
    side[bih.child[inner]] = bih.axis[inner]
    side[bih.child[inner] + 1] = bih.axis[inner] + 3
    first, count = np.where(bih.count > 0, bih.child, 0), bih.count
    tables = {**triangle_table(triangles, bih.order, last_of_leaves(first, count, bih.order)),
              BIH_NODE.name: {"left_hi": bih.left_hi, "right_lo": bih.right_lo,
                              "axis": bih.axis, "child": bih.child},
              BIH_BOUNDS.name: {"lo": lo, "hi": hi, "parent": bih.parents(), "side": side}}
    uniforms = {"scene_lo": tuple(bih.lo), "scene_hi": tuple(bih.hi), "node_count": nodes}
    # A ray enters each node at most once, climbs from it at most once, and tests each triangle at
    # most once. With a stack, it also pops each node at most once.
    bound = (3 if options["stack_size"] else 2) * nodes + len(bih.order)
    return Accelerator(tables, uniforms, bound, bih, boxes=bih.boxes)


FAMILY = "BIH"
ROWS = (Method(
    name="bih",
    summary="traverses a tree with two planes per node, the end of the left and the start of the "
            "right child; climbs the parents after each leaf",
    citation="Waechter and Keller 2006",
    glsl="methods/bih/bih.glsl",
    kernels=("down", "intersect", "climb"),
    state=BIH_STATE,
    tables=(TRIANGLE, BIH_NODE, BIH_BOUNDS),
    prepare=_prepare,
    options=(
        Option("max_leaf", 4, "largest number of triangles in a leaf", int, minimum=1,
               label="triangles per leaf"),
        Option("stack_size", 0, "number of stack entries, in a local array that is lost at the "
               "end of a pass; 0: no stack, only links to parents", int, choices=(0, 4, 16),
               define="STACK_SIZE", label="stack entries"),
    ),
    own_array=lambda options: options["stack_size"] > 0,
    fixed_defines={"ROOT": ROOT},
    no_era_form="its stack is an array with integer indices, which the era form lacks; without "
                "a stack, the method has not been compiled for any card",
),)
