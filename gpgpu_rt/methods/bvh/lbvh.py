"""LBVH: a bounding volume hierarchy from sorted Morton codes.

C. Lauterbach, M. Garland, S. Sengupta, D. Luebke, D. Manocha, "Fast BVH Construction on GPUs",
Eurographics 2009. The triangles are sorted by their codes. A triangle's place in this order is its
slot. Each gap between neighbouring slots gives an inner node. The node's level is the first bit in
which the two codes at the gap differ. The paper sorts a list of the gaps by level.

Here, a node spans all slots around its gap whose codes agree in the bits before the node's level.
Its parent is the node of the gap at one end of this span: of the gap whose two codes share more
leading bits. Slot numbers are appended to the codes, so that no two codes are equal.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...accel.bounds import triangle_boxes
from ...accel.morton import morton_3d
from ...accel.options import in_range, refuse_unknown
from .tree import MAX_LEAF, LooseTree

AXIS_BITS = 10          # bits of a code for each axis; a code has three times as many bits
SLOT_BITS = 24          # bits of a slot number


def build(triangles: np.ndarray, *, morton_bits: int = AXIS_BITS, max_leaf: int = MAX_LEAF,
          **unknown: object) -> LooseTree:
    """Build by Morton codes. Every node of at most `max_leaf` triangles becomes a leaf.

    morton_bits : bits of the code per axis, for 2^morton_bits cells along each axis
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
    """Return the exponent of the power of two that scales all coordinates to at most about 1."""
    _, exponent = np.frexp(np.abs(triangles).max(initial=0))
    return int(np.clip(-exponent, -126, 126))


def centroids(triangles: np.ndarray) -> np.ndarray:
    """Return the centres of the triangles' boxes, (3, n) float32, scaled by 2^`unit_exponent`."""
    exponent = unit_exponent(triangles)
    lo, hi = (np.ldexp(corner, exponent) for corner in triangle_boxes(triangles))
    return lo * np.float32(0.5) + hi * np.float32(0.5)


def morton_codes(triangles: np.ndarray, bits: int = AXIS_BITS) -> np.ndarray:
    """Return the Morton codes of the triangles, (n,) int64, 30 bits each.

    From the highest bit down, bits of x, y and z alternate: `bits` per axis, then zeros.
    """
    centre = centroids(triangles)
    low = centre.min(axis=1, keepdims=True)
    cells = np.float32(1 << bits)
    with np.errstate(all="ignore"):
        per_unit = cells / (centre.max(axis=1, keepdims=True) - low)
        place = (centre - low) * per_unit
    # Along an axis whose extent is zero or has no finite inverse, use the first cell.
    place[(per_unit > 3e38)[:, 0]] = 0
    cell = place.astype(np.int64).clip(0, (1 << bits) - 1) << (AXIS_BITS - bits)
    return morton_3d(*cell)


def sorted_codes(triangles: np.ndarray, bits: int = AXIS_BITS) -> tuple[np.ndarray, np.ndarray]:
    """Return the codes in ascending order and their triangles, by a stable sort."""
    code = morton_codes(triangles, bits)
    order = np.argsort(code, kind="stable")
    return code[order], order


@dataclass
class RadixTree:
    """The binary tree over n sorted codes, with an inner node for each gap between neighbours.

    Attributes
    ----------
    first, last : (n - 1,) int64, the first and the last slot that a gap's node spans
    bits : (n - 1,) int64, the number of leading bits that the codes of the node's slots share
    """

    first: np.ndarray
    last: np.ndarray
    bits: np.ndarray

    @staticmethod
    def of(code: np.ndarray) -> RadixTree:
        """Build the tree over (n,) ascending codes of 30 bits. Slot numbers separate equal codes.
        """
        key = code << SLOT_BITS | np.arange(len(code))
        total = 3 * AXIS_BITS + SLOT_BITS
        differ = key[:-1] ^ key[1:]
        # A float64's exponent gives the first differing bit. `differ` has up to 54 bits, but the
        # float64 holds 53, so shift by one bit.
        bits = total - 1 - np.frexp((differ >> 1).astype(np.float64))[1]
        below = (np.int64(1) << (total - bits)) - 1
        return RadixTree(np.searchsorted(key, key[:-1] & ~below),
                         np.searchsorted(key, key[:-1] | below, side="right") - 1, bits)

    def parents(self, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Return the parent of each node, given its first and last slot; -1 for the root.

        A parent is the index of the gap between a node and its sibling.
        """
        bits = np.concatenate([[-1], self.bits, [-1]])
        before, after = bits[first], bits[last + 1]
        return np.where(np.maximum(before, after) < 0, -1,
                        np.where(after > before, last, first - 1))

    def cut(self, kept: np.ndarray, order: np.ndarray) -> LooseTree:
        """Return the tree with the kept gaps as inner nodes. Slots between kept gaps form leaves.

        kept : (n - 1,) bool; the caller ensures that the ancestors of a kept gap are kept too
        order : (n,) int64, the triangle of each slot
        """
        gaps = np.flatnonzero(kept)
        gaps = gaps[np.argsort(self.bits[gaps], kind="stable")]     # the root has the fewest bits
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
