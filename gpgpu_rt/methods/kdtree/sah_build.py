"""SAH build: builds a kd-tree by the surface area heuristic (SAH), a level of nodes at a time.

I. Wald, V. Havran, "On building fast kd-trees for ray tracing, and on doing that in O(N log N)",
2006. A reference is a node's entry for a triangle, clipped to the node. Splits that cut off empty
space get a bonus. By default, the depth limit for n triangles is 8 + 1.3 log2 n (V. Havran,
thesis, 2000). All boxes are widened by `bounds.padding`, so that a triangle in a split plane is on
both sides.
"""
from __future__ import annotations

import numpy as np

from ...accel.bounds import padding
from ...accel.options import choose, in_range, refuse_unknown
from ...threads import threads
from . import shevtsov
from .sah import Costs
from .sah_growth import Rules, grow, root_level, sah_costs
from .tree import LooseKdTree, depth_cap


def build(triangles: np.ndarray, *, split: str = "binned", bins: int = 32,
          traversal_cost: float = Costs.traversal, intersection_cost: float = Costs.intersection,
          empty_bonus: float = Costs.empty_bonus,
          max_depth: int | None = None, clip: bool = True, workers: int = 1,
          **unknown: object) -> LooseKdTree:
    """Build by the surface area heuristic.

    With the default options, the bunny's tree has about as many leaves as the tree of Popov et al.
    2007 (survey, Figure 17).

    Parameters
    ----------
    split : Candidate planes: "exact" for the faces of all references' boxes, or "binned" for the
        ends of bins. Nodes with few references always use all faces.
    bins : Number of bins along each axis of a node.
    traversal_cost, intersection_cost : Cost of a node and of a triangle, in any common unit.
    empty_bonus : Share by which a split costs less if at least a fifth of the node is cut off as
        empty space.
    max_depth : Largest depth of a leaf; None for 8 + 1.3 log2 n.
    clip : If True, a reference's box bounds the triangle's part in the node. If False, the box is
        the triangle's box, cut to the node.
    workers : Number of processes that grow subtrees. The tree depends on this number only if a
        group of subtrees reaches the limit on references (see `shevtsov`).
    """
    refuse_unknown(build, unknown)
    rules = Rules(sah_costs(traversal_cost, intersection_cost, empty_bonus),
                  choose("split", split, ("binned", "exact")),
                  in_range("bins", bins, 2, 1024, int), depth_cap(triangles, max_depth),
                  padding(triangles))
    vertices = np.ascontiguousarray(triangles.transpose(1, 2, 0)) if clip else None
    workers = in_range("workers", workers, 1, 256, int)
    level = root_level(triangles, rules.pad)
    if workers > 1:
        return shevtsov.grow_on_processes(level, vertices, rules, workers)
    return grow(level, 0, vertices, rules, run=threads(len(triangles)))[0].loose()
