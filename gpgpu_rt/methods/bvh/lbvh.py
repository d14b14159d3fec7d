"""LBVH: a bounding volume hierarchy from sorted Morton codes.

C. Lauterbach, M. Garland, S. Sengupta, D. Luebke, D. Manocha, "Fast BVH Construction on GPUs",
Eurographics 2009. Triangles are sorted along a space-filling curve; where the codes of neighbours
part is a node, and the bit at which they part is its level. What they do by sorting a list of
splits by level is read off the sorted codes here: a node spans all slots that share the bits
before that one, and its parent is whichever of the gaps at its two ends parts later. Triangles of
one code are halved by the bits of their places.

`methods/bvh/gpu_build/lbvh.py` does the same by fragment passes, node for node.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...accel.bounds import triangle_boxes
from ...accel.morton import morton_3d
from ...accel.options import in_range, refuse_unknown
from .tree import MAX_LEAF, LooseTree

AXIS_BITS = 10          # of a code, which has three times as many
SLOT_BITS = 24


def build(triangles: np.ndarray, *, morton_bits: int = AXIS_BITS, max_leaf: int = MAX_LEAF,
          **unknown: object) -> LooseTree:
    """Every node of at most `max_leaf` triangles becomes a leaf.

    morton_bits : lattice cells an axis, as a power of two
    """
    refuse_unknown(build, unknown)
    morton_bits = in_range("morton_bits", morton_bits, 1, AXIS_BITS, int)
    max_leaf = in_range("max_leaf", max_leaf, 1, 64, int)
    if len(triangles) == 0:
        empty = np.zeros(0, np.int64)
        return LooseTree(empty, empty, empty, empty)
    code, order = sorted_codes(triangles, morton_bits)
    tree = RadixTree.of(code)
    return tree.cut(tree.last - tree.first >= max_leaf, order)


def unit_exponent(triangles: np.ndarray) -> int:
    """The power of two that coordinates are multiplied by, to be at most about 1 in size."""
    _, exponent = np.frexp(np.abs(triangles).max(initial=0))
    return int(np.clip(-exponent, -126, 126))


def centroids(triangles: np.ndarray) -> np.ndarray:
    """(3, n) float32, middles of the triangles' boxes, in units of about the scene's size."""
    exponent = unit_exponent(triangles)
    lo, hi = (np.ldexp(corner, exponent) for corner in triangle_boxes(triangles))
    return lo * np.float32(0.5) + hi * np.float32(0.5)


def morton_codes(triangles: np.ndarray, bits: int = AXIS_BITS) -> np.ndarray:
    """(n,) int64, 30 bits each: x, y, z from the highest, `bits` of each axis, then zeros."""
    centre = centroids(triangles)
    low = centre.min(axis=1, keepdims=True)
    cells = np.float32(1 << bits)
    with np.errstate(all="ignore"):
        per_unit = cells / (centre.max(axis=1, keepdims=True) - low)
        place = (centre - low) * per_unit
    # An extent of zero has no cells but the first; nor has one whose inverse overflows.
    place[(per_unit > 3e38)[:, 0]] = 0
    cell = place.astype(np.int64).clip(0, (1 << bits) - 1) << (AXIS_BITS - bits)
    return morton_3d(*cell)


def sorted_codes(triangles: np.ndarray, bits: int = AXIS_BITS) -> tuple[np.ndarray, np.ndarray]:
    """Codes in ascending order, and the triangles they belong to: lowest index first of equals."""
    code = morton_codes(triangles, bits)
    order = np.argsort(code, kind="stable")
    return code[order], order


@dataclass
class RadixTree:
    """The binary tree over n sorted codes: an inner node for each gap between neighbours.

    first, last : (n - 1,) int64, the slots that a gap's node spans
    bits : (n - 1,) int64, leading bits that all of them share
    """

    first: np.ndarray
    last: np.ndarray
    bits: np.ndarray

    @staticmethod
    def of(code: np.ndarray) -> RadixTree:
        """Of (n,) ascending codes of 30 bits; slots of one code part by their places' bits."""
        key = code << SLOT_BITS | np.arange(len(code))
        total = 3 * AXIS_BITS + SLOT_BITS
        differ = key[:-1] ^ key[1:]
        # A float64 holds 53 bits and the key has 54: halve, and the exponent stays right.
        bits = total - 1 - np.frexp((differ >> 1).astype(np.float64))[1]
        below = (np.int64(1) << (total - bits)) - 1
        return RadixTree(np.searchsorted(key, key[:-1] & ~below),
                         np.searchsorted(key, key[:-1] | below, side="right") - 1, bits)

    def parents(self, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        """The gap that joins each span of slots to its sibling; -1 for the whole."""
        bits = np.concatenate([[-1], self.bits, [-1]])
        before, after = bits[first], bits[last + 1]
        return np.where(np.maximum(before, after) < 0, -1,
                        np.where(after > before, last, first - 1))

    def cut(self, kept: np.ndarray, order: np.ndarray) -> LooseTree:
        """The tree of the kept gaps alone, with what lies between them as leaves.

        kept : (n - 1,) bool; of a kept gap all ancestors are kept
        order : (n,) int64, the triangle of each slot
        """
        gaps = np.flatnonzero(kept)
        gaps = gaps[np.argsort(self.bits[gaps], kind="stable")]     # the root parts first
        starts = np.flatnonzero(np.append(True, kept))
        ends = np.append(starts[1:], len(order)) - 1
        nodes = len(gaps) + len(starts)
        left, right = np.full(nodes, -1, np.int64), np.full(nodes, -1, np.int64)
        number = np.full(len(kept) + 1, -1, np.int64)
        number[gaps] = np.arange(len(gaps))
        first = np.concatenate([self.first[gaps], starts])
        last = np.concatenate([self.last[gaps], ends])
        parent = self.parents(first, last)
        below = np.flatnonzero(parent >= 0)
        on_left = parent[below] == last[below]
        left[number[parent[below[on_left]]]] = below[on_left]
        right[number[parent[below[~on_left]]]] = below[~on_left]
        count = np.concatenate([np.zeros(len(gaps), np.int64), ends - starts + 1])
        return LooseTree(left, right, count, order)
