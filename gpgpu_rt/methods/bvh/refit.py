"""Refitting: fit the boxes of a hierarchy to triangles that moved, and keep the tree.

I. Wald, S. Boulos, P. Shirley, "Ray tracing deformable scenes using dynamic bounding volume
hierarchies", ACM TOG 26(1), 2007. While triangles move, the boxes overlap more and more. The
tracer rebuilds the tree when its SAH cost exceeds `rebuild_ratio` times the cost after the last
build. The default is 1.4, after "RT-DEFORM" (C. Lauterbach, S.-E. Yoon, D. Tuft, D. Manocha,
2006), which rebuilds when another measure of the tree has grown by 40 %. The SAH cost is relative
to the root's area, so it may not rise when triangles fly apart; then choose a lower
`rebuild_ratio`.
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
    """The links of a tree for refitting, computed once per tree.

    Attributes
    ----------
    leaves : (l,) int64, the leaves in the order of their triangles in `Bvh.order`
    starts : (l,) int64, the position of each leaf's first triangle in `Bvh.order`
    inner : for each depth, deepest first: the inner nodes, the left children, the right children
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
        """Return the tree with boxes fitted to the moved ``triangles``, (n, 3, 3) float32, which
        have the same order as at the build."""
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
