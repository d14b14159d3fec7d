"""Ropes: links each face of each leaf of a kd-tree to the node behind the face.

S. Popov, J. Günther, H.-P. Seidel, P. Slusallek, "Stackless KD-Tree Traversal for High Performance
GPU Ray Tracing", Eurographics 2007. The construction goes down from the root, which has no ropes.
The two children of a node share a face on its split plane. On this face, each child gets a rope to
the other child. On all other faces, a child inherits its parent's ropes.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...accel import tree_order
from .tree import LEAF, KdTree

NIL = -1


@dataclass(frozen=True)
class Ropes:
    """The leaves of a kd-tree, in the order of their nodes, with boxes and ropes.

    Attributes
    ----------
    node : (m,) int32, each leaf's node
    lo, hi : (m, 3) float32, each leaf's box, world units
    rope_lo, rope_hi : (m, 3) int32, the node behind the lower and the upper face across each axis,
        or NIL
    """

    node: np.ndarray
    lo: np.ndarray
    hi: np.ndarray
    rope_lo: np.ndarray
    rope_hi: np.ndarray

    @property
    def bytes(self) -> int:
        """Bytes of all ropes and boxes."""
        return 48 * len(self.node)


def build_ropes(tree: KdTree, push_down: bool = True) -> Ropes:
    """Build the ropes of a tree.

    Parameters
    ----------
    push_down : if True, a rope leads to the smallest node that touches the whole face; if False,
        to the root of the sibling subtree, where a packet's rays meet again
    """
    lo, hi = tree.boxes()
    ropes = np.full((2, len(tree.axis), 3), NIL, np.int32)   # (lower or upper face, node, axis)
    inner = tree.axis != LEAF
    first, second = np.where(inner, tree.left, -1), np.where(inner, tree.left + 1, -1)
    for nodes in tree_order.inner_levels(first, second):
        one, two, axis = first[nodes], second[nodes], tree.axis[nodes]
        ropes[:, one] = ropes[:, two] = ropes[:, nodes]
        ropes[1, one, axis], ropes[0, two, axis] = two, one
    leaves = np.flatnonzero(~inner).astype(np.int32)
    lo, hi, ropes = lo[leaves], hi[leaves], ropes[:, leaves]
    if push_down:
        for upper in (0, 1):
            for axis in range(3):
                ropes[upper, :, axis] = _pushed_down(tree, ropes[upper, :, axis], lo, hi, axis,
                                                     bool(upper))
    return Ropes(leaves, lo, hi, ropes[0], ropes[1])


def _pushed_down(tree: KdTree, rope: np.ndarray, lo: np.ndarray, hi: np.ndarray, face: int,
                 upper: bool) -> np.ndarray:
    """Move the ropes of leaves' faces down the tree.

    ``upper`` selects the upper or the lower faces across the axis ``face``. A rope moves to a
    child of its target as long as this child touches the whole face.
    """
    rope = rope.copy()
    moving = np.flatnonzero(rope != NIL)
    while len(moving):
        node = rope[moving]
        axis = tree.axis[node]
        inner = axis != LEAF
        moving, node, axis = moving[inner], node[inner], axis[inner].astype(np.int64)
        plane, left = tree.split[node], tree.left[node]
        below, above = plane >= hi[moving, axis], plane <= lo[moving, axis]
        across = axis == face     # the split is parallel to the face: one child touches all of it
        takes_left = np.where(across, upper, below)
        goes_on = across | below | above
        rope[moving[goes_on]] = np.where(takes_left, left, left + 1)[goes_on]
        moving = moving[goes_on]
    return rope
