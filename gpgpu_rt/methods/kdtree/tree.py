"""Kd-tree: the finished tree, and the loose tree that builders return."""
from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...accel import tree_order
from ...accel.options import in_range
from ...accel.runs import expand, run_starts
from ...accel.sound import alike, are_pairs, named, within

LEAF = 3                # the axis of a leaf
MOST_REFERENCES = 64    # growth stops above 4096 + 64 n references for n triangles


@dataclass(frozen=True)
class KdTree:
    """A kd-tree. Node 0 is the root, and a right child directly follows the left child.

    Attributes
    ----------
    lo, hi : (3,) float32, the padded scene box, world units
    axis : (n,) int8, 0, 1, 2, or 3 for a leaf
    split : (n,) float32, the split plane's coordinate; 0 for a leaf
    left : (n,) int32, the left child of an inner node (the right child is left + 1), or a leaf's
        first reference
    count : (n,) int32, the number of references of a leaf; 0 for an inner node
    references : (m,) int32, triangles, leaf by leaf; ascending within a leaf
    depth : int, the number of edges from the root to the deepest leaf
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
        """Return each node's parent, (n,) int32; -1 for the root."""
        return tree_order.pair_parents(self.left, self.axis != LEAF)

    def boxes(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and upper corners of all nodes' boxes, (n, 3) float32, world units."""
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

    def is_sound(self, triangles: int) -> bool:
        """Whether the arrays are valid for ``triangles`` triangles; see ``accel/sound.py``."""
        n = len(self.axis)
        return (n > 0 and alike(named(self, "lo hi"), "f", 3)
                and alike(named(self, "split"), "f", n)
                and alike(named(self, "axis left count"), "i", n)
                and within(self.references, triangles)
                and are_pairs(self.axis, self.left, self.count, len(self.references), self.depth))


@dataclass
class LooseKdTree:
    """The result of a builder: a kd-tree with its nodes in any order. Node 0 is the root.

    Attributes
    ----------
    axis, split : (n,) as in `KdTree`
    first, second : (n,) int64, left and right child, -1 for a leaf
    start, count : (n,) int64, a leaf's first reference and its number of references; the count of
        an inner node is 0
    references : (m,) int32, triangles
    """

    axis: np.ndarray
    split: np.ndarray
    first: np.ndarray
    second: np.ndarray
    start: np.ndarray
    count: np.ndarray
    references: np.ndarray

    def finish(self, lo: np.ndarray, hi: np.ndarray) -> KdTree:
        """Return the finished tree, with pairs of siblings in depth-first order.

        lo, hi : (3,) float32, the scene's box, world units
        """
        first, second = self.first, self.second
        inner = tree_order.inner_levels(first, second)
        size = tree_order.subtree_sizes(inner, first, second)
        place = tree_order.depth_first_pairs(inner, size, first, second)
        order = np.argsort(place)
        first, count = first[order], self.count[order]
        left = np.where(first >= 0, place[first], run_starts(count))
        return KdTree(lo, hi, self.axis[order], self.split[order], left.astype(np.int32),
                      count.astype(np.int32), self.references[expand(self.start[order], count)],
                      len(inner))

    def coarsened(self, most: int) -> LooseKdTree:
        """Return a tree of at most `most` nodes and at most `most` references.

        In a larger tree, every subtree with at most k references becomes a leaf, which lists each
        triangle once. The limits set k.
        """
        tree, nodes = self, min(most, len(self.axis))
        while nodes and (len(tree.axis) > most or len(tree.references) > most):
            tree = self._with_nodes(nodes)
            nodes = nodes * 7 // 8
        return tree

    def _with_nodes(self, most: int) -> LooseKdTree:
        inner = tree_order.inner_levels(self.first, self.second)
        kept = tree_order.kept_nodes(inner, self.first, self.second, self.count, most)
        inside, first, second, place = tree_order.cut(inner, self.first, self.second, kept)
        owner = np.repeat(place, self.count)
        held = self.references[expand(self.start, self.count)]
        key = np.unique(owner << 32 | held)
        count = np.bincount(key >> 32, minlength=int(kept.sum()))
        return LooseKdTree(np.where(inside, self.axis, LEAF)[kept].astype(self.axis.dtype),
                           np.where(inside, self.split, 0)[kept].astype(self.split.dtype),
                           first, second, run_starts(count), count,
                           (key & 0xffffffff).astype(self.references.dtype))


def join(top: LooseKdTree, groups: list[np.ndarray], subtrees: list[LooseKdTree]) -> LooseKdTree:
    """Join the top levels of a tree and the subtrees below them.

    Parameters
    ----------
    top : the top levels, n nodes. A child n + k is the root of subtree k
    groups : the numbers k of each group's subtrees
    subtrees : each group's nodes: first the subtrees' roots, in the order of `groups`
    """
    nodes_above = len(top.axis)
    parts, numbers = [top], [np.arange(nodes_above)]
    free = nodes_above + sum(map(len, groups))
    for roots, tree in zip(groups, subtrees):
        below = len(tree.axis) - len(roots)
        numbers.append(np.concatenate([nodes_above + roots, free + np.arange(below)]))
        parts.append(tree)
        free += below
    held = run_starts(np.array([len(part.references) for part in parts]))

    def joined(name: str, values: list[np.ndarray]) -> np.ndarray:
        whole = np.empty(free, getattr(parts[0], name).dtype)
        whole[np.concatenate(numbers)] = np.concatenate(values)
        return whole

    def children(name: str) -> np.ndarray:
        named = [getattr(part, name) for part in parts]
        return joined(name, named[:1] + [np.where(child < 0, child, number[child])
                                         for child, number in zip(named[1:], numbers[1:])])
    return LooseKdTree(
        *(joined(name, [getattr(part, name) for part in parts]) for name in ("axis", "split")),
        children("first"), children("second"),
        joined("start", [part.start + first for part, first in zip(parts, held)]),
        joined("count", [part.count for part in parts]),
        np.concatenate([part.references for part in parts]))


def depth_cap(triangles: np.ndarray, max_depth: int | None) -> int:
    """Return `max_depth`; if None, 8 + 1.3 log2 n (V. Havran, thesis, 2000) for n triangles."""
    if max_depth is None:
        max_depth = int(8 + 1.3 * math.log2(max(len(triangles), 1)))
    return in_range("max_depth", max_depth, 0, 128, int)
