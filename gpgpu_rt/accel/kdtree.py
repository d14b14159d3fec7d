"""Kd-tree: the record, and its build by the surface area heuristic, one level at a time.

After I. Wald, V. Havran, "On building fast kd-trees for ray tracing, and on doing that in
O(N log N)", 2006: greedy SAH, references clipped to their node, a bonus for empty space, no
look-ahead. The depth is capped at 8 + 1.3 log2 n (V. Havran, thesis, 2000), and all nodes of
a level are split together by whole-array operations. Every triangle is widened by
`bounds.PADDING` of the scene, so that one that lies in a split plane is on both sides.
"""
from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from . import tree_order
from .bounds import as_triangles, padding, scene_box, triangle_boxes
from .clip import clip_bounds
from .options import choose, in_range, refuse_unknown
from .runs import expand, owners, run_starts
from .sah import Costs, Level, best_splits

LEAF = 3                # the axis of a leaf
MOST_REFERENCES = 64    # a triangle, on average; past it the tree stops growing


@dataclass(frozen=True)
class KdTree:
    """A kd-tree; siblings are neighbours, node 0 is the root.

    lo, hi : (3,) float32, the padded scene box, world units
    axis : (n,) int8, 0, 1, 2, or 3 for a leaf
    split : (n,) float32, the plane's coordinate; 0 for a leaf
    left : (n,) int32, inner: the left child (the right one is left + 1); leaf: first reference
    count : (n,) int32, references of a leaf; 0 for an inner node
    references : (m,) int32, triangles leaf by leaf, ascending within one
    depth : int, edges from the root to the deepest leaf
    """

    lo: np.ndarray
    hi: np.ndarray
    axis: np.ndarray
    split: np.ndarray
    left: np.ndarray
    count: np.ndarray
    references: np.ndarray
    depth: int

    def parents(self) -> np.ndarray:
        """(n,) int32, -1 for the root."""
        parent = np.full(len(self.axis), -1, np.int32)
        inner = np.flatnonzero(self.axis != LEAF)
        parent[self.left[inner]] = inner
        parent[self.left[inner] + 1] = inner
        return parent

    def boxes(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corners of all nodes, (n, 3) float32 each."""
        lo = np.tile(self.lo, (len(self.axis), 1))
        hi = np.tile(self.hi, (len(self.axis), 1))
        inner = self.axis != LEAF
        first = np.where(inner, self.left, -1)
        second = np.where(inner, self.left + 1, -1)
        for nodes in tree_order.inner_levels(first, second):
            one, two, axis = first[nodes], second[nodes], self.axis[nodes]
            lo[one] = lo[two] = lo[nodes]
            hi[one] = hi[two] = hi[nodes]
            hi[one, axis] = lo[two, axis] = self.split[nodes]
        return lo, hi


def build_kdtree(triangles: np.ndarray, *, split: str = "binned", bins: int = 32,
                 traversal_cost: float = 1.0, intersection_cost: float = 2.0,
                 empty_bonus: float = 0.2, max_depth: int | None = None, clip: bool = True,
                 **unknown: object) -> KdTree:
    """Build a kd-tree.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units
    split : "binned" (exact for nodes with few references) or "exact"
    bins : bins an axis and node
    traversal_cost, intersection_cost : of one node and of one triangle, in any common unit; the
        defaults give the bunny about the leaves of Popov et al. 2007 (the survey's Figure 17)
    empty_bonus : share of its cost that a split is spared when it cuts off a fifth or more of
        its node as empty space
    max_depth : None for 8 + 1.3 log2 n
    clip : whether references are bounded by the triangle's part in the node, not by its box

    Raises
    ------
    OptionError, SceneError
    """
    refuse_unknown(build_kdtree, unknown)
    choose("split", split, ("binned", "exact"))
    bins = in_range("bins", bins, 2, 1024, int)
    costs = Costs(in_range("traversal_cost", traversal_cost, 0, 1e6),
                  in_range("intersection_cost", intersection_cost, 1e-6, 1e6),
                  in_range("empty_bonus", empty_bonus, 0, 0.999))
    triangles = as_triangles(triangles)
    if max_depth is None:
        max_depth = int(8 + 1.3 * math.log2(max(len(triangles), 1)))
    max_depth = in_range("max_depth", max_depth, 0, 128, int)
    vertices = np.ascontiguousarray(triangles.transpose(1, 2, 0)) if clip else None
    pad = padding(triangles)
    level = _root(triangles, pad)
    record = _Record(*scene_box(triangles))
    limit = MOST_REFERENCES * len(triangles) + 4096
    for depth in range(max_depth + 1):
        if depth < max_depth and record.kept + len(level.triangle) <= limit:
            best = best_splits(level, costs, split, bins)
            inner = best.cost < intersection_cost * level.count
        else:
            inner = np.zeros(len(level.count), bool)
        nodes = np.flatnonzero(inner)
        if not len(nodes):
            record.add(level, inner)
            break
        record.add(level, inner, best.axis[nodes], best.plane[nodes])
        level = _children(level, nodes, best.axis[nodes], best.plane[nodes], vertices, pad)
    return record.finish()


def _root(triangles: np.ndarray, pad: np.float32) -> Level:
    lo, hi = scene_box(triangles)
    box_lo, box_hi = triangle_boxes(triangles)
    return Level(lo[:, None], hi[:, None], np.array([len(triangles)]),
                 np.arange(len(triangles), dtype=np.int32),
                 np.concatenate([box_lo - pad, box_hi + pad]))


def _children(level: Level, nodes: np.ndarray, axis: np.ndarray, plane: np.ndarray,
              vertices: np.ndarray | None, pad: np.float32) -> Level:
    """The children of the given nodes: all left ones, then all right ones, so that the
    references stay in the order of their nodes when they are merely filtered twice."""
    count = level.count[nodes]
    index = expand(run_starts(level.count)[nodes], count)
    owner = owners(count)
    row, cut = axis.astype(np.int64)[owner], plane[owner]
    flat, width = level.box.reshape(-1), level.box.shape[1]
    lo, hi = flat.take(row * width + index), flat.take((row + 3) * width + index)
    goes_left = (lo < cut) | (hi <= cut)
    goes_right = hi > cut
    pick = np.arange(len(nodes))
    left_hi, right_lo = level.hi[:, nodes], level.lo[:, nodes]
    left_hi[axis, pick] = right_lo[axis, pick] = plane
    sides = ((goes_left, level.lo[:, nodes], left_hi), (goes_right, right_lo, level.hi[:, nodes]))
    across = np.flatnonzero(goes_left & goes_right)
    parts = [_child(level, index, owner, across, side, lo, hi, vertices, pad)
             for side, lo, hi in sides]
    joined = [np.concatenate(pair, axis=-1) for pair in zip(*parts)]
    return Level(*joined)


def _child(level: Level, index: np.ndarray, owner: np.ndarray, across: np.ndarray,
           side: np.ndarray, lo: np.ndarray, hi: np.ndarray, vertices: np.ndarray | None,
           pad: np.float32) -> tuple[np.ndarray, ...]:
    """One child of every split node, as the fields of a Level.

    across : the positions in `index` of references on both sides, which are clipped
    """
    triangle, node = level.triangle[index[across]], owner[across]
    box_lo, box_hi = lo[:, node], hi[:, node]
    if vertices is None:
        old = level.box[:, index[across]]
        box = np.concatenate([np.maximum(old[:3], box_lo), np.minimum(old[3:], box_hi)])
    else:
        part_lo, part_hi = clip_bounds(vertices, triangle, box_lo - pad, box_hi + pad)
        empty = part_lo[0] > part_hi[0]
        side = side.copy()
        side[across[empty]] = False
        box = np.concatenate([np.maximum(part_lo - pad, box_lo),
                             np.minimum(part_hi + pad, box_hi)])
        box = box[:, ~empty]
    clipped = np.zeros(len(index), bool)
    clipped[across] = True
    kept = np.flatnonzero(side)
    result = level.box.take(index[kept], axis=1)
    result[:, clipped[kept]] = box
    count = np.bincount(owner[kept], minlength=lo.shape[1])
    return lo, hi, count, level.triangle[index[kept]], result


class _Record:
    """Collects the nodes level by level and puts them in their final order."""

    def __init__(self, lo: np.ndarray, hi: np.ndarray) -> None:
        self.lo, self.hi = lo, hi
        self.fields: list[tuple[np.ndarray, ...]] = []
        self.references: list[np.ndarray] = []
        self.nodes = self.kept = 0

    def add(self, level: Level, inner: np.ndarray, axis: np.ndarray | None = None,
            plane: np.ndarray | None = None) -> None:
        """Append a level; `axis` and `plane` belong to its inner nodes."""
        n, split_count = len(inner), int(inner.sum())
        axes, planes = np.full(n, LEAF, np.int8), np.zeros(n, np.float32)
        first, second = np.full(n, -1, np.int64), np.full(n, -1, np.int64)
        if split_count:
            axes[inner], planes[inner] = axis, plane
            first[inner] = self.nodes + n + np.arange(split_count)
            second[inner] = first[inner] + split_count
        count = np.where(inner, 0, level.count)
        leaves = np.flatnonzero(~inner)
        index = expand(run_starts(level.count)[leaves], level.count[leaves])
        self.references.append(level.triangle[index])
        self.fields.append((axes, planes, first, second, count))
        self.nodes += n
        self.kept += len(index)

    def finish(self) -> KdTree:
        """Siblings side by side, subtrees depth-first: a path's nodes lie close together."""
        axis, plane, first, second, count = map(np.concatenate, zip(*self.fields))
        inner = tree_order.inner_levels(first, second)
        size = tree_order.subtree_sizes(inner, first, second)
        place = tree_order.depth_first_pairs(inner, size, first, second)
        order = np.argsort(place)
        start = run_starts(count)[order]
        axis, plane, first, count = axis[order], plane[order], first[order], count[order]
        references = np.concatenate(self.references)[expand(start, count)]
        left = np.where(first >= 0, place[first], run_starts(count))
        return KdTree(self.lo, self.hi, axis, plane, left.astype(np.int32),
                      count.astype(np.int32), references, len(self.fields) - 1)
