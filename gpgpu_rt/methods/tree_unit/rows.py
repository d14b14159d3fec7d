"""tree-unit: one traversal for kd-trees and BVHs.

The survey (section 5) proposes such a traversal for hardware. A ray returns to a node's far child
as in kd-backtrack."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...options import Option
from ...traversal.accelerator import Accelerator
from ...traversal.leaf_lists import leaf_tables
from ...traversal.method import LEAF_LIST, Method, Part
from ...traversal.triangle_table import REFERENCE, TRIANGLE, box_uniforms, triangle_table
from ..bvh.build import node_limit
from ..bvh.builders import BUILD_OPTIONS as BVH_BUILD
from ..bvh.builders import built_bvh
from ..kdtree.builders import BUILD_OPTIONS as KD_BUILD
from ..kdtree.builders import built_kdtree
from .records import UNIT_BOUNDS, UNIT_NODE, UNIT_STATE
from .tree import LEAF, ROOT, UnitTree, from_bvh, from_kdtree

INTERVAL, BOX = "interval", "box"


def _defaults(options: tuple[Option, ...]) -> dict[str, Any]:
    return {option.name: option.default for option in options}


def _tree(triangles: np.ndarray, criterion: str) -> tuple[UnitTree, dict[str, Any]]:
    """Return the tree for a criterion, and the uniforms of the scene's box."""
    if criterion == BOX:
        limit = node_limit(len(triangles), 1)
        return (from_bvh(built_bvh(triangles, _defaults(BVH_BUILD), **limit)),
                box_uniforms(triangles))
    tree = built_kdtree(triangles, _defaults(KD_BUILD))
    return from_kdtree(tree), {"scene_lo": tuple(tree.lo), "scene_hi": tuple(tree.hi)}


def _prepare(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    tree, uniforms = _tree(triangles, options["criterion"])
    tables = {
        **triangle_table(triangles),
        **leaf_tables(UNIT_NODE, {"child": tree.child, "count": tree.count, "axis": tree.axis,
                                  "split": tree.split},
                      "child", tree.axis == LEAF, tree.references, options),
        UNIT_BOUNDS.name: {"lo": tree.lo, "hi": tree.hi, "parent": tree.parents(),
                           "side": tree.sides()}}
    # A ray enters each node and climbs from each node at most once.
    return Accelerator(tables, uniforms, 2 * len(tree.axis) + len(tree.references), tree,
                       boxes=tree.boxes)


FAMILY = "kd-tree or BVH"
ROWS = (Method(
    name="tree-unit",
    summary="traverses a kd-tree or a BVH with the same kernels; an option sets the criterion "
            "that chooses the children",
    citation="Foley and Sugerman 2005",
    glsl="methods/tree_unit/tree_unit.glsl",
    kernels=("down", "intersect", "climb"),
    state=UNIT_STATE,
    tables=(TRIANGLE, UNIT_NODE, UNIT_BOUNDS, REFERENCE),
    prepare=_prepare,
    options=(Option(
        "criterion", INTERVAL, "how a ray chooses a node's children: interval cuts its "
        "interval at a kd-tree's split plane, box tests the boxes of a BVH",
        choices=(INTERVAL, BOX), label="choose children by"),),
    parts=(LEAF_LIST, Part("criterion", "criterion", "methods/tree_unit/interval.glsl",
                           {BOX: "methods/tree_unit/box.glsl"})),
    fixed_defines={"ROOT": ROOT},
),)
