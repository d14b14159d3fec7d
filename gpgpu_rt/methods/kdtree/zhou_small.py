"""Splits small nodes (up to 64 references) of Zhou's build by the SAH, with 64-bit masks."""
from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...accel.runs import chunks, run_starts
from .sah import Costs, KdLevel, SplitCost

if TYPE_CHECKING:
    from .zhou import Nodes

FACES = 6           # faces of a reference's box: first the three lower, then the three upper faces
CHUNK = 1 << 17     # references processed together


class SmallRoots:
    """The small nodes whose parents are large, or the tree's root if it is small."""

    def __init__(self) -> None:
        self._parts: list[tuple[np.ndarray, ...]] = []

    def add(self, level: KdLevel, node: np.ndarray, levels: int) -> None:
        """Add the nodes of a level. The caller ensures that all of them are small.

        Parameters
        ----------
        node : the numbers of the nodes in `zhou.Nodes`
        levels : the largest number of levels that are allowed below each node
        """
        self._parts.append((level.lo, level.hi, level.count, level.triangle, level.box, node,
                            np.full(len(node), levels)))

    def joined(self) -> tuple[KdLevel, np.ndarray, np.ndarray]:
        """Return all small nodes as a level, their node numbers, and the levels allowed below."""
        *level, node, levels = (np.concatenate(part, axis=-1) for part in zip(*self._parts))
        return KdLevel(*level), node, levels


def side_masks(level: KdLevel) -> np.ndarray:
    """Return masks of the references left and right of each candidate plane (a face of a box).

    The masks are (2, 6, m) uint64, indexed by side (0 is left), face and reference. Bit j stands
    for reference j of the node.
    """
    masks = np.zeros((2, FACES, len(level.triangle)), np.uint64)
    starts = run_starts(level.count)
    for nodes in chunks(level.count, CHUNK):
        base, count = np.repeat([starts[nodes], level.count[nodes]], level.count[nodes], axis=1)
        if not len(base):
            continue
        first = int(base[0])
        for j in range(int(count.max())):
            some = np.flatnonzero(count > j)
            other = level.box[:, base[some] + j]
            for face in range(FACES):
                plane = level.box[face, first + some]
                lo, hi = other[face % 3], other[face % 3 + 3]
                left = (lo < plane) | (hi <= plane)
                masks[0, face, first + some] |= left.astype(np.uint64) << np.uint64(j)
                masks[1, face, first + some] |= (hi > plane).astype(np.uint64) << np.uint64(j)
    return masks


def grow_small(roots: SmallRoots, costs: Costs, nodes: Nodes) -> None:
    """Split small nodes and their descendants while it lowers the cost, within depth limits."""
    level, node, levels = roots.joined()
    masks, base = side_masks(level), run_starts(level.count)
    mask = ~np.uint64(0) >> (np.uint64(64) - level.count.astype(np.uint64))
    lo, hi = level.lo, level.hi
    while len(node):
        cost, best = _best(level, masks, base, mask, lo, hi, costs)
        inner = cost < np.float32(costs.intersection) * population(mask).astype(np.float32)
        inner &= levels > 0
        leaf, inner = np.flatnonzero(~inner), np.flatnonzero(inner)
        which, bit = bits(mask[leaf])
        nodes.leaf(node[leaf], population(mask[leaf]), level.triangle[base[leaf][which] + bit])
        reference, face = base[inner] + best[inner] // FACES, best[inner] % FACES
        axis, plane = face % 3, level.box[face, reference]
        children = nodes.split(node[inner], axis, plane)
        left_hi, right_lo = hi[:, inner], lo[:, inner]
        left_hi[axis, np.arange(len(inner))] = right_lo[axis, np.arange(len(inner))] = plane
        mask = (mask[inner] & masks[:, face, reference]).reshape(-1)
        lo = np.concatenate([lo[:, inner], right_lo], axis=1)
        hi = np.concatenate([left_hi, hi[:, inner]], axis=1)
        node, base = np.concatenate(children), np.tile(base[inner], 2)
        levels = np.tile(levels[inner], 2) - 1


def _best(level: KdLevel, masks: np.ndarray, base: np.ndarray, mask: np.ndarray, lo: np.ndarray,
          hi: np.ndarray, costs: Costs) -> tuple[np.ndarray, np.ndarray]:
    """Return the cost of each node's best plane, and the plane's number, 6 * bit + face.

    The cost is inf for a node without a plane. On a tie, the lowest number is chosen.
    """
    cost, best = np.full(len(mask), np.inf, np.float32), np.zeros(len(mask), np.int64)
    count = population(mask)
    some = np.flatnonzero(count)
    for part in chunks(count[some], CHUNK):
        nodes = some[part]
        owner, bit = bits(mask[nodes])
        reference = base[nodes][owner] + bit
        found = np.empty((len(owner), FACES), np.float32)
        for face in range(FACES):
            left, right = (population(mask[nodes][owner] & masks[side, face, reference])
                           .astype(np.float32) for side in (0, 1))
            found[:, face] = SplitCost(costs, lo[:, nodes], hi[:, nodes], face % 3).at(
                level.box[face, reference], left, right, owner)
        starts = run_starts(count[nodes])
        of_reference = found.argmin(axis=1)
        lowest = found[np.arange(len(found)), of_reference]
        cost[nodes] = np.minimum.reduceat(lowest, starts)
        first = np.flatnonzero(lowest == cost[nodes][owner])
        first = first[np.searchsorted(first, starts)]
        best[nodes] = FACES * bit[first] + of_reference[first]
    return cost, best


def bits(masks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return, for all set bits of all masks in order, the mask's index and the bit's number."""
    rows = masks.astype("<u8").view(np.uint8).reshape(-1, 8)
    return np.nonzero(np.unpackbits(rows, axis=1, bitorder="little"))


def population(masks: np.ndarray) -> np.ndarray:
    """Return the number of set bits of each mask, int64."""
    n = masks - ((masks >> np.uint64(1)) & np.uint64(0x5555555555555555))
    pairs = np.uint64(0x3333333333333333)
    n = (n & pairs) + ((n >> np.uint64(2)) & pairs)
    n = (n + (n >> np.uint64(4))) & np.uint64(0x0f0f0f0f0f0f0f0f)
    return ((n * np.uint64(0x0101010101010101)) >> np.uint64(56)).astype(np.int64)
