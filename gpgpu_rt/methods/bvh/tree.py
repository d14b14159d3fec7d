"""Bounding volume hierarchy: the tree, threaded by escape indices.

Nodes lie in depth-first order. A ray that enters inner node i goes on to node i + 1. A ray that
misses node i, or has finished leaf i, goes on to node escape[i], so traversal needs no stack (N.
Thrane, L. O. Simonsen, "A comparison of acceleration structures for GPU assisted ray tracing",
2005; B. Smits, "Efficiency issues for ray tracing", 1998).
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...accel import tree_order
from ...accel.bounds import half_area, triangle_boxes
from ...accel.runs import expand, owners, run_starts
from ...accel.sound import alike, are_leaves, each_once, is_tree, named, within

MAX_LEAF = 4        # default for the largest number of triangles in a leaf


@dataclass(frozen=True)
class Bvh:
    """A binary tree of boxes in depth-first order.

    Node 0 is the root. Inner node i has the left child i + 1 and the right child escape[i + 1].

    Attributes
    ----------
    lo, hi : (n, 3) float32, the exact boxes, world units
    escape : (n,) int32, the first node after node i's subtree, or n if there is none
    first, count : (n,) int32, the start and length of a leaf's run in `order`; 0 for an inner node
    order : (m,) int32, the triangles, leaf by leaf; ascending within a leaf
    depth : int, the number of edges from the root to the deepest leaf
    """

    lo: np.ndarray
    hi: np.ndarray
    escape: np.ndarray
    first: np.ndarray
    count: np.ndarray
    order: np.ndarray
    depth: int

    def leaves(self) -> np.ndarray:
        """Return whether each node is a leaf, (n,) bool."""
        return self.count > 0

    def children(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the left and right child of every node, (n,) int64 each; -1 for a leaf."""
        nodes = np.arange(len(self.count), dtype=np.int64)
        inner = ~self.leaves()
        left = np.where(inner, nodes + 1, -1)
        right = np.full(len(nodes), -1, np.int64)
        right[inner] = self.escape[left[inner]]
        return left, right

    def is_sound(self, triangles: int) -> bool:
        """Whether the arrays are valid for ``triangles`` triangles; see ``accel/sound.py``."""
        n = len(self.escape)
        if not (alike(named(self, "lo hi"), "f", n, 3)
                and alike(named(self, "escape first count"), "i", n)
                and each_once(self.order, triangles)
                and are_leaves(self.first, self.count, triangles)
                and within(self.escape, n + 1)):
            return False
        if not n:
            return triangles == 0
        inner = np.flatnonzero(self.count == 0)
        if len(inner) and inner[-1] + 1 >= n or (self.escape <= np.arange(n)).any():
            return False
        if len(inner) and self.escape[inner + 1].max() >= n:
            return False
        left, right = self.children()
        return (is_tree(left, right, self.depth) and self.escape[0] == n and bool(
            (self.escape[right[inner]] == self.escape[inner]).all()))


@dataclass
class LooseTree:
    """The result of a builder: a binary tree with nodes in any order and without boxes.

    Attributes
    ----------
    left, right : (n,) int64, each node's children, -1 for a leaf; node 0 is the root
    count : (n,) int64, the number of triangles of a leaf
    triangle : (m,) int, the triangles, leaf by leaf in the order of the nodes
    """

    left: np.ndarray
    right: np.ndarray
    count: np.ndarray
    triangle: np.ndarray

    def coarsened(self, most_nodes: int) -> LooseTree:
        """Return a tree of at most `most_nodes` nodes.

        In a larger tree, every subtree with at most k triangles becomes a leaf, for a suitable k.
        """
        if len(self.left) <= most_nodes:
            return self
        inner = tree_order.inner_levels(self.left, self.right)
        return self._cut(inner, tree_order.kept_nodes(inner, self.left, self.right, self.count,
                                                      most_nodes))

    def with_leaves(self, triangles: np.ndarray, max_leaf: int) -> LooseTree:
        """Turn subtrees of at most `max_leaf` triangles into leaves if the SAH cost does not rise.

        The tests of a box and of a triangle both cost 1.
        """
        inner = tree_order.inner_levels(self.left, self.right) if len(self.left) else []
        if not inner:
            return self
        area = half_area(*(corner.T.astype(np.float64) for corner in self.boxes(triangles)))
        held, leaf = self.count.copy(), self.left < 0
        cost = area * held
        for nodes in reversed(inner):
            left, right = self.left[nodes], self.right[nodes]
            held[nodes] = held[left] + held[right]
            split, joined = 2 * area[nodes] + cost[left] + cost[right], area[nodes] * held[nodes]
            leaf[nodes] = (held[nodes] <= max_leaf) & (joined <= split)
            cost[nodes] = np.where(leaf[nodes], joined, split)
        kept = np.ones(len(leaf), bool)
        for nodes in inner:
            kept[self.left[nodes]] = kept[self.right[nodes]] = kept[nodes] & ~leaf[nodes]
        return self._cut(inner, kept)

    def _cut(self, inner: list[np.ndarray], kept: np.ndarray) -> LooseTree:
        """Return the tree of the nodes that ``kept``, (n,) bool, marks.

        A kept node without kept children becomes a leaf of all triangles below it.
        """
        _, left, right, place = tree_order.cut(inner, self.left, self.right, kept)
        owner = np.repeat(place, self.count)
        return LooseTree(left, right, np.bincount(owner, minlength=len(left)),
                         self.triangle[np.argsort(owner, kind="stable")])

    def thread(self, triangles: np.ndarray) -> Bvh:
        """Return the hierarchy in depth-first order, with boxes."""
        if len(triangles) == 0:
            return Bvh(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32),
                       *(np.zeros(0, np.int32) for _ in range(4)), 0)
        left, right = self.left, self.right
        inner = tree_order.inner_levels(left, right)
        size = tree_order.subtree_sizes(inner, left, right)
        lo, hi = self.boxes(triangles)
        source = np.argsort(tree_order.depth_first(inner, size, left, right))
        count = self.count[source]
        index = expand(run_starts(self.count)[source], count)
        leaf = owners(count)
        key = np.sort(leaf << 32 | self.triangle[index])        # ascending within each leaf
        first = np.where(count > 0, run_starts(count), 0)
        escape = np.arange(len(size)) + size[source]
        return Bvh(lo[source], hi[source], escape.astype(np.int32), first.astype(np.int32),
                   count.astype(np.int32), (key & 0xffffffff).astype(np.int32), len(inner))

    def boxes(self, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and upper corners of all boxes, (n, 3) float32 each."""
        inner = tree_order.inner_levels(self.left, self.right)
        box_lo, box_hi = triangle_boxes(triangles)
        lo = np.empty((len(self.left), 3), np.float32)
        hi = np.empty((len(self.left), 3), np.float32)
        leaves = np.flatnonzero(self.left < 0)
        starts = run_starts(self.count)[leaves]
        lo[leaves] = np.minimum.reduceat(box_lo[:, self.triangle], starts, axis=1).T
        hi[leaves] = np.maximum.reduceat(box_hi[:, self.triangle], starts, axis=1).T
        for nodes in reversed(inner):
            left, right = self.left[nodes], self.right[nodes]
            lo[nodes] = np.minimum(lo[left], lo[right])
            hi[nodes] = np.maximum(hi[left], hi[right])
        return lo, hi
