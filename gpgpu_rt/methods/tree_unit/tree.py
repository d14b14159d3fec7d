"""Unit tree: a kd-tree or a BVH in the common node format of `tree-unit`."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...accel import tree_order
from ..bvh.tree import Bvh
from ..kdtree.tree import KdTree

LEAF = 3    # the axis of a leaf
ROOT = 6    # the field ``side`` (UNIT_BOUNDS) of the root, which has no parent
OPEN = np.float32(3e38)     # the coordinate of a face that no ray reaches


@dataclass(frozen=True)
class UnitTree:
    """A binary tree. Node 0 is the root, and a right child directly follows the left child.

    Attributes
    ----------
    child, count, axis : (n,) int, as in UNIT_NODE
    split : (n,) float32, as in UNIT_NODE, world units
    lo, hi : (n, 3) float32, the boxes, world units
    references : (m,) int32, the triangles of all leaves, leaf by leaf
    """

    child: np.ndarray
    count: np.ndarray
    axis: np.ndarray
    split: np.ndarray
    lo: np.ndarray
    hi: np.ndarray
    references: np.ndarray

    def boxes(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and upper corners of all boxes, (n, 3) float32 each, world units."""
        return self.lo, self.hi

    def parents(self) -> np.ndarray:
        """Return each node's parent, (n,) int32; -1 for the root."""
        return tree_order.pair_parents(self.child, self.axis != LEAF)

    def sides(self) -> np.ndarray:
        """Return the field ``side`` of UNIT_BOUNDS, (n,) int64."""
        side = np.full(len(self.axis), ROOT)
        inner = np.flatnonzero(self.axis != LEAF)
        side[self.child[inner]] = self.axis[inner]
        side[self.child[inner] + 1] = self.axis[inner] + 3
        return side


def from_kdtree(tree: KdTree) -> UnitTree:
    """Return a kd-tree in the common format.

    Faces on the scene's box move out to OPEN: rounding could end a ray's interval before a
    triangle on such a face. The scene's box still clips the ray.
    """
    lo, hi = tree.boxes()
    return UnitTree(tree.left, tree.count, tree.axis, tree.split,
                    np.where(lo <= tree.lo, -OPEN, lo), np.where(hi >= tree.hi, OPEN, hi),
                    tree.references)


def from_bvh(bvh: Bvh) -> UnitTree:
    """Return a BVH in the common format.

    The axis of an inner node is the axis along which its children's centres lie furthest apart. A
    tree without nodes becomes a leaf without references.
    """
    if not len(bvh.escape):
        nothing = np.zeros(1, np.int32)
        corner = np.zeros((1, 3), np.float32)
        return UnitTree(nothing, nothing, nothing + LEAF, corner[:, 0], corner, corner, bvh.order)
    left, right = bvh.children()
    inner = left >= 0
    middle = bvh.lo.astype(np.float64) + bvh.hi
    apart = middle[right] - middle[left]
    nodes, axis = np.arange(len(left)), np.abs(apart).argmax(axis=1)
    swapped = inner & (apart[nodes, axis] < 0)
    left, right = np.where(swapped, right, left), np.where(swapped, left, right)
    levels = tree_order.inner_levels(left, right)
    place = tree_order.depth_first_pairs(
        levels, tree_order.subtree_sizes(levels, left, right), left, right)
    order = np.argsort(place)
    child = np.where(inner, place[left], bvh.first)
    return UnitTree(child[order], bvh.count[order], np.where(inner, axis, LEAF)[order],
                    np.zeros(len(left), np.float32), bvh.lo[order], bvh.hi[order], bvh.order)
