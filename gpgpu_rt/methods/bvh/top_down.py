"""Top-down build of a binary tree over triangles. All nodes of a level are split together.

The triangles are sorted once by centroid along each axis. In each of the three orders, a node's
triangles are consecutive. A split along an axis gives the first of them in this axis's order to
the left child. Stable partitions keep all three orders sorted.
"""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...accel.bounds import triangle_boxes
from ...accel.runs import expand, owners, run_starts
from .tree import LooseTree


@dataclass
class TriangleLevel:
    """The nodes of one depth, which are to be split.

    Attributes
    ----------
    order : (3, m) int64; row a lists the triangles node by node, in each node by centroid along
        axis a
    count : (k,) int64, the number of triangles of each node
    lo, hi, centroid : (3, n) float32, boxes and centroids of all triangles, divided by a power of
        two so that no coordinate exceeds 1
    depth : int
    """

    order: np.ndarray
    count: np.ndarray
    lo: np.ndarray
    hi: np.ndarray
    centroid: np.ndarray
    depth: int

    def extents(self) -> np.ndarray:
        """Return the extent of each node's centroids along each axis, (3, k) float32."""
        starts = run_starts(self.count)
        ends = starts + self.count - 1
        return np.stack([self.centroid[a][self.order[a, ends]]
                         - self.centroid[a][self.order[a, starts]] for a in range(3)])


# A splitter returns each node's split axis and number of left triangles; 0 makes a leaf.
Splitter = Callable[[TriangleLevel], tuple[np.ndarray, np.ndarray]]


def build(triangles: np.ndarray, splitter: Splitter,
          cluster: np.ndarray | None = None) -> LooseTree:
    """Split nodes until the splitter makes every node a leaf.

    cluster : (n,) int, each triangle's cluster, counted from 0; no cluster is empty. Each cluster
        becomes a tree, and the first nodes of the result are their roots. None: a single tree
    """
    # Scale by a power of two, which is exact: areas must not underflow or overflow.
    _, exponent = np.frexp(np.abs(triangles).max(initial=0))
    lo, hi = (np.ldexp(corner, -exponent) for corner in triangle_boxes(triangles))
    centroid = lo * np.float32(0.5) + hi * np.float32(0.5)
    n = len(triangles)
    if cluster is None:
        order = np.argsort(centroid, axis=1, kind="stable")
        count = np.array([n] if n else [])
    else:
        order = np.stack([np.lexsort([along, cluster]) for along in centroid])
        count = np.bincount(cluster)
    level = TriangleLevel(order, count, lo, hi, centroid, 0)
    left_child, right_child, counts, leaves = [], [], [], []
    nodes = 0
    goes_left = np.zeros(n, bool)
    while len(level.count):
        axis, taken = splitter(level)
        inner = taken > 0
        splits = np.flatnonzero(inner)
        first = np.full(len(inner), -1, np.int64)
        second = np.full(len(inner), -1, np.int64)
        nodes += len(inner)
        first[splits] = nodes + np.arange(len(splits))
        second[splits] = first[splits] + len(splits)
        left_child.append(first)
        right_child.append(second)
        counts.append(np.where(inner, 0, level.count))
        starts, done = run_starts(level.count), np.flatnonzero(~inner)
        leaves.append(level.order[0, expand(starts[done], level.count[done])])
        level = _children(level, starts[splits], level.count[splits], axis[splits],
                          taken[splits], goes_left)
    if not counts:
        empty = np.zeros(0, np.int64)
        return LooseTree(empty, empty, empty, empty)
    return LooseTree(*map(np.concatenate, (left_child, right_child, counts, leaves)))


def _children(level: TriangleLevel, starts: np.ndarray, count: np.ndarray, axis: np.ndarray,
              taken: np.ndarray, goes_left: np.ndarray) -> TriangleLevel:
    """Return the next level: all left children, then all right children.

    `goes_left`, (n,) bool, is scratch memory.
    """
    index, owner = expand(starts, count), owners(count)
    rank = index - starts[owner]
    goes_left[level.order[axis[owner], index]] = rank < taken[owner]
    orders = []
    for order in level.order:
        order = order[index]
        side = goes_left[order]
        orders.append(np.concatenate([order[side], order[~side]]))
    return TriangleLevel(np.stack(orders), np.concatenate([taken, count - taken]), level.lo,
                         level.hi, level.centroid, level.depth + 1)
