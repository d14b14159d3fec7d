"""A tree in eight orders, each front to back for the rays of a direction octant."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...accel import tree_order
from ...accel.bounds import half_area
from ...accel.options import in_range
from ...gl.record import EXACT_INTEGER
from .tree import Bvh

# Of the rays that meet a box, the share from which on one inside it is not worth a test: a half
# breaks even by count, and from there to 0.9 rates were measured alike (docs/bvh.md).
MET_ANYWAY = 0.65


@dataclass(frozen=True)
class OctantCopies:
    """Eight orders of a tree's nodes, or of those that are kept, each with the child first that a
    ray meets first.

    Copy o is for directions whose component a is negative exactly where bit a of o is set. Small
    subtrees may stand once behind all copies, in the tree's own order: near the leaves it matters
    little which child comes first. A copy then holds such a subtree's root, its portal.

    source : (8, n) int32, which node of the tree each node is
    escape : (8, n) int32, the first node of its copy after a node's subtree; n where there is none
    below : (8, n) int32, where among the shared nodes what stands below a portal begins; -1 of
        nodes that are none
    shared : (m,) int32, which node of the tree each shared node is
    shared_escape : (m,) int32, among the shared nodes; m where its shared subtree ends
    bvh : the tree
    """

    source: np.ndarray
    escape: np.ndarray
    below: np.ndarray
    shared: np.ndarray
    shared_escape: np.ndarray
    bvh: Bvh

    @classmethod
    def of(cls, bvh: Bvh, met_anyway: float = MET_ANYWAY, shared_subtrees: int = 0
           ) -> OctantCopies:
        """The copies of a tree. Which child is nearer is judged by the distance of the children's
        centres along the axis where it is largest.

        Parameters
        ----------
        met_anyway : inner nodes are left out, and a node has up to as many children as it takes,
            where more than this share of the rays that meet the node above meet them as well; 1
            leaves out none
        shared_subtrees : subtrees of at most so many nodes are shared; 0 for none

        Raises
        ------
        OptionError
        """
        in_range("shared_subtrees", shared_subtrees, 0, EXACT_INTEGER, int)
        left, right = bvh.children()
        inner = tree_order.inner_levels(left, right) if len(left) else []
        size = tree_order.subtree_sizes(inner, left, right)
        small = (size <= shared_subtrees) & (left >= 0)
        top = np.arange(len(left))      # the largest small subtree's root around each node
        for nodes in inner:
            for child in (left[nodes], right[nodes]):
                top[child] = np.where(small[nodes], top[nodes], child)
        within = top != np.arange(len(left))
        portal = small & ~within
        kept = portal | _worth_a_test(bvh, inner, left, right, portal, met_anyway)
        # The orders are of what no other node shares: there portals are leaves.
        upper, number = np.flatnonzero(~within), np.cumsum(~within) - 1
        left, right = (np.where(portal[upper] | (child[upper] < 0), -1, number[child[upper]])
                       for child in (left, right))
        inner = tree_order.inner_levels(left, right) if len(left) else []
        size = tree_order.subtree_sizes(inner, left, right)
        order = np.argsort(_front_to_back(bvh.lo[upper].astype(np.float64) + bvh.hi[upper],
                                          inner, size, left, right), axis=1)
        escape = np.arange(len(left)) + size[order]
        source = upper[order]
        copied = kept[source]
        before = np.pad(np.cumsum(copied, axis=1), ((0, 0), (1, 0)))    # that many are kept
        escape = np.take_along_axis(before, escape, axis=1)
        source, escape = (values[copied].reshape(8, -1) for values in (source, escape))
        # The tree's own order is depth-first too.
        shared = np.flatnonzero(kept & within)
        shared_before = np.append(0, np.cumsum(kept & within))
        below = np.where(portal, shared_before[1:], -1)
        shared_escape = np.where(bvh.escape[shared] < bvh.escape[top[shared]],
                                 shared_before[bvh.escape[shared]], len(shared))
        return cls(*(values.astype(np.int32) for values in (
            source, escape, below[source], shared, shared_escape)), bvh)

    @property
    def records(self) -> int:
        """How many nodes are stored in all."""
        return self.source.size + self.shared.size

    @property
    def lo(self) -> np.ndarray:
        """(8, n, 3) float32."""
        return self.bvh.lo[self.source]

    @property
    def hi(self) -> np.ndarray:
        """(8, n, 3) float32."""
        return self.bvh.hi[self.source]

    @property
    def first(self) -> np.ndarray:
        """(8, n) int32."""
        return self.bvh.first[self.source]

    @property
    def count(self) -> np.ndarray:
        """(8, n) int32."""
        return self.bvh.count[self.source]


def times_stored(shared_subtrees: int | None) -> float:
    """How many times at most, about, a tree's nodes are stored: of the trees of bunny, robots,
    kitchen and conference 2.1 times with subtrees of 16 nodes, 1.5 of 32 and 1.2 of 64. One that
    is lopsided has fewer small subtrees to share, and more are stored."""
    return min(8.0, 1 + 32 / shared_subtrees) if shared_subtrees else 8.0


def _front_to_back(centre: np.ndarray, inner: list[np.ndarray], size: np.ndarray,
                   left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """(8, n) int64, the place of each node in the depth-first order of each octant; ``centre``:
    (n, 3) float64, twice the middle of its box."""
    apart = np.zeros((len(left), 3))
    nodes = np.flatnonzero(left >= 0)
    apart[nodes] = centre[right[nodes]] - centre[left[nodes]]
    axis = np.abs(apart).argmax(axis=1)
    apart = np.take_along_axis(apart, axis[:, None], 1)[:, 0]
    # The right child lies on the positive side of `axis`: first for negative rays.
    negative = (np.arange(8)[:, None] >> axis) & 1 == 1
    swapped = ((apart > 0) & negative) | ((apart < 0) & ~negative)
    return tree_order.depth_first(inner, size, np.where(swapped, right, left),
                                  np.where(swapped, left, right))


def _worth_a_test(bvh: Bvh, inner: list[np.ndarray], left: np.ndarray, right: np.ndarray,
                  always: np.ndarray, met_anyway: float) -> np.ndarray:
    """(n,) bool: leaves, nodes that are ``always`` kept, and inner nodes that spare enough rays
    their children. Of the rays that meet a box as large a share meets one inside as that has of
    its surface."""
    area = half_area(bvh.lo.T.astype(np.float64), bvh.hi.T.astype(np.float64))
    kept, around = np.ones(len(left), bool), area.copy()    # `around`: of the node kept above
    for nodes in inner:
        for child in (left[nodes], right[nodes]):
            needless = (left[child] >= 0) & ~always[child] & (
                area[child] > met_anyway * around[nodes])
            kept[child] = ~needless
            around[child] = np.where(needless, around[nodes], area[child])
    return kept
