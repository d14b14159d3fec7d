"""Refitting: the boxes of a hierarchy around triangles that moved, its tree as it was.

I. Wald, S. Boulos, P. Shirley, "Ray tracing deformable scenes using dynamic bounding volume
hierarchies", ACM TOG 26(1), 2007. Linear, a level at a time from the leaves up; but boxes of a
tree that was built for other places come to overlap, so it is built anew when its cost has grown
too much. C. Lauterbach, S.-E. Yoon, D. Tuft, D. Manocha, "RT-DEFORM", 2006, rebuild at 40 % more;
we take that share of the surface area heuristic's cost over its cost at the last build. (Cost is
by the root's area: of what flies apart a new tree would cost less and less, which the ratio does
not see. There a lower one pays.)
"""
from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...accel import tree_order
from ...accel.bounds import triangle_boxes
from .tree import Bvh

REBUILD_RATIO = 1.4


@dataclass(frozen=True)
class Refitter:
    """What refitting one tree takes, worked out once.

    leaves : (l,) int64, the leaves in the order of their runs in `Bvh.order`
    starts : (l,) int64, where those begin
    inner : (nodes, left, right) of each depth, the deepest first
    """

    leaves: np.ndarray
    starts: np.ndarray
    inner: list[tuple[np.ndarray, np.ndarray, np.ndarray]]

    @classmethod
    def of(cls, bvh: Bvh) -> Refitter:
        left, right = bvh.children()
        levels = tree_order.inner_levels(left, right) if len(left) else []
        leaves = np.flatnonzero(bvh.leaves())
        return cls(leaves, bvh.first[leaves].astype(np.int64),
                   [(nodes, left[nodes], right[nodes]) for nodes in reversed(levels)])

    def refit(self, bvh: Bvh, triangles: np.ndarray) -> Bvh:
        """The tree with exact boxes around (n, 3, 3) float32 triangles, as many as before."""
        if not len(self.leaves):
            return bvh
        box_lo, box_hi = triangle_boxes(triangles.take(bvh.order, axis=0))
        lo, hi = np.empty_like(bvh.lo), np.empty_like(bvh.hi)
        lo[self.leaves] = np.minimum.reduceat(box_lo, self.starts, axis=1).T
        hi[self.leaves] = np.maximum.reduceat(box_hi, self.starts, axis=1).T
        for nodes, left, right in self.inner:
            lo[nodes] = np.minimum(lo.take(left, axis=0), lo.take(right, axis=0))
            hi[nodes] = np.maximum(hi.take(left, axis=0), hi.take(right, axis=0))
        return replace(bvh, lo=lo, hi=hi)
