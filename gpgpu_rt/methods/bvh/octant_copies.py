"""Octant copies: copies a tree eight times, ordered front to back for the rays of each octant."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...accel import tree_order
from ...accel.bounds import half_area
from ...accel.options import in_range
from ...gl.record import EXACT_INTEGER
from .tree import Bvh

# The copies omit an inner node if its box is hit by more than this share of the rays that hit its
# nearest kept ancestor (estimated by areas): its test then costs more than it saves. Measured
# rates are flat from 0.5 to 0.9 (docs/notes/bvh.md).
MET_ANYWAY = 0.65


@dataclass(frozen=True)
class OctantCopies:
    """Eight copies of a tree, one per octant: nearer children first, without needless nodes.

    Copy o is for directions whose component a is negative if and only if bit a of o is set. Small
    subtrees may be shared: they are stored once, after the copies, in the tree's own order. Each
    copy keeps only the root of a shared subtree, the portal.

    Attributes
    ----------
    source : (8, n) int32, for each node of a copy, the original node of the tree
    escape : (8, n) int32, the first node after a node's subtree in its copy; n if there is none
    below : (8, n) int32, the first shared node below a portal; -1 if the node is not a portal
    shared : (m,) int32, for each shared node, the node of the tree
    shared_escape : (m,) int32, each shared node's escape index in `shared`; m if it leads outside
        the shared subtree
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
        """Return the octant copies of a tree.

        Siblings are ordered along the axis on which their centres lie furthest apart.

        Parameters
        ----------
        met_anyway : as MET_ANYWAY; 1 omits no node
        shared_subtrees : store a subtree of at most this many nodes once for all copies

        Raises
        ------
        OptionError
            if `shared_subtrees` is out of range
        """
        in_range("shared_subtrees", shared_subtrees, 0, EXACT_INTEGER, int)
        left, right = bvh.children()
        inner = tree_order.inner_levels(left, right) if len(left) else []
        size = tree_order.subtree_sizes(inner, left, right)
        small = (size <= shared_subtrees) & (left >= 0)
        top = np.arange(len(left))      # root of each node's shared subtree; without one, the node
        for nodes in inner:
            for child in (left[nodes], right[nodes]):
                top[child] = np.where(small[nodes], top[nodes], child)
        within = top != np.arange(len(left))
        portal = small & ~within
        kept = portal | _worth_a_test(bvh, inner, left, right, portal, met_anyway)
        # Order the nodes outside shared subtrees. Portals count as leaves.
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
        before = np.pad(np.cumsum(copied, axis=1), ((0, 0), (1, 0)))
        escape = np.take_along_axis(before, escape, axis=1)
        source, escape = (values[copied].reshape(8, -1) for values in (source, escape))
        shared = np.flatnonzero(kept & within)
        shared_before = np.append(0, np.cumsum(kept & within))
        below = np.where(portal, shared_before[1:], -1)
        shared_escape = np.where(bvh.escape[shared] < bvh.escape[top[shared]],
                                 shared_before[bvh.escape[shared]], len(shared))
        return cls(*(values.astype(np.int32) for values in (
            source, escape, below[source], shared, shared_escape)), bvh)

    @property
    def records(self) -> int:
        """The number of stored nodes: all copies and the shared nodes."""
        return self.source.size + self.shared.size

    @property
    def lo(self) -> np.ndarray:
        """The lower corners of the copied nodes, (8, n, 3) float32."""
        return self.bvh.lo[self.source]

    @property
    def hi(self) -> np.ndarray:
        """The upper corners of the copied nodes, (8, n, 3) float32."""
        return self.bvh.hi[self.source]

    @property
    def first(self) -> np.ndarray:
        """The first triangle of each copied leaf, (8, n) int32."""
        return self.bvh.first[self.source]

    @property
    def count(self) -> np.ndarray:
        """The number of triangles of each copied leaf, (8, n) int32."""
        return self.bvh.count[self.source]


def times_stored(shared_subtrees: int | None) -> float:
    """Return about how many times octant copies store a node, on average.

    An unbalanced tree has fewer subtrees to share, and may exceed this number.
    """
    return min(8.0, 1 + 32 / shared_subtrees) if shared_subtrees else 8.0


def _front_to_back(centre: np.ndarray, inner: list[np.ndarray], size: np.ndarray,
                   left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return each node's position in the depth-first order of each octant, (8, n) int64.

    ``centre`` is (n, 3) float64, twice the centre of each node's box.
    """
    apart = np.zeros((len(left), 3))
    nodes = np.flatnonzero(left >= 0)
    apart[nodes] = centre[right[nodes]] - centre[left[nodes]]
    axis = np.abs(apart).argmax(axis=1)
    apart = np.take_along_axis(apart, axis[:, None], 1)[:, 0]
    # If `apart` is positive, negative directions along `axis` reach the right child first.
    negative = (np.arange(8)[:, None] >> axis) & 1 == 1
    swapped = ((apart > 0) & negative) | ((apart < 0) & ~negative)
    return tree_order.depth_first(inner, size, np.where(swapped, right, left),
                                  np.where(swapped, left, right))


def _worth_a_test(bvh: Bvh, inner: list[np.ndarray], left: np.ndarray, right: np.ndarray,
                  always: np.ndarray, met_anyway: float) -> np.ndarray:
    """Return whether to keep each node, (n,) bool.

    Leaves and nodes in ``always`` are kept; other nodes only if they prune enough (MET_ANYWAY).
    """
    area = half_area(bvh.lo.T.astype(np.float64), bvh.hi.T.astype(np.float64))
    # `around` is the area of the nearest kept node at or above each node.
    kept, around = np.ones(len(left), bool), area.copy()
    for nodes in inner:
        for child in (left[nodes], right[nodes]):
            needless = (left[child] >= 0) & ~always[child] & (
                area[child] > met_anyway * around[nodes])
            kept[child] = ~needless
            around[child] = np.where(needless, around[nodes], area[child])
    return kept
