"""Surface area heuristic: find the cheapest split plane for each kd-tree node of a level.

J. D. MacDonald, K. S. Booth, "Heuristics for ray tracing using space subdivision", The Visual
Computer 6, 1990. The option `split` selects one of two kinds of candidate planes:

`exact` tries every face of every reference's box; a reference is a triangle in a node (I. Wald, V.
Havran, "On building fast kd-trees for ray tracing, and on doing that in O(N log N)", 2006).
References are sorted on every level; the paper keeps them sorted by merging.

`binned` divides the extent of a node's references into bins, and tries the ends of the bins. Two
histograms count the lower and the upper faces in each bin (M. Shevtsov, A. Soupikov, A. Kapustin,
"Highly parallel fast kd-tree construction for interactive ray tracing of dynamic scenes",
Eurographics 2007). As in this paper, nodes with few references are searched exactly. The outermost
ends lie on the lowest and on the highest face, so a split there can cut off empty space.
"""
from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...accel.runs import chunks, expand, of_like_length, owners, run_starts
from ...threads import Run

FEW = 16                # nodes of at most this many references are searched exactly
# Nodes with similar numbers of references are searched together. These are the largest numbers of
# the groups.
FEW_SIZES = (1, 2, 3, 4, 6, 8, 12, FEW)
WORTH_CUTTING = 0.2     # a split that cuts off at least this share of empty space gets a bonus


@dataclass
class KdLevel:
    """The nodes of one depth, which are to be split, and their references, node by node.

    Attributes
    ----------
    lo, hi : (3, k) float32, the nodes' boxes
    count : (k,) int64, the number of references of each node
    triangle : (m,) int32, the triangle of each reference
    box : (6, m) float32, lower and upper corner of each reference's box, clipped and padded
    """

    lo: np.ndarray
    hi: np.ndarray
    count: np.ndarray
    triangle: np.ndarray
    box: np.ndarray


@dataclass
class Splits:
    """The best split of each node. Its cost is for a ray that hits the node; inf: no split."""

    cost: np.ndarray
    axis: np.ndarray
    plane: np.ndarray

    @classmethod
    def none(cls, nodes: int) -> Splits:
        return cls(np.full(nodes, np.inf, np.float32), np.zeros(nodes, np.int8),
                   np.zeros(nodes, np.float32))

    def offer(self, nodes: np.ndarray, cost: np.ndarray, axis: int, plane: np.ndarray) -> None:
        """Replace the splits of these nodes where the new splits are cheaper."""
        better = np.flatnonzero(cost < self.cost[nodes])
        taken = nodes[better]
        self.cost[taken], self.axis[taken], self.plane[taken] = cost[better], axis, plane[better]


@dataclass(frozen=True)
class Costs:
    """The constants of the heuristic, in any common unit.

    A split that cuts off empty space costs (1 - empty_bonus) times as much if the space is at
    least the share `WORTH_CUTTING` of the node.
    """

    traversal: float = 1.0
    intersection: float = 2.0
    empty_bonus: float = 0.2

    def split(self, level: KdLevel, nodes: np.ndarray, axis: int) -> SplitCost:
        return SplitCost(self, level.lo[:, nodes], level.hi[:, nodes], axis)


class SplitCost:
    """The cost of splitting nodes across an axis, as a function of plane and counts."""

    def __init__(self, costs: Costs, lo: np.ndarray, hi: np.ndarray, axis: int) -> None:
        size = hi - lo
        size = size / size.max(axis=0)      # so that areas neither underflow nor overflow
        width, b, c = size[axis], size[(axis + 1) % 3], size[(axis + 2) % 3]
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = costs.intersection / (width * (b + c) + b * c)
            self.cap = scale * (b * c)                    # the two faces across the axis
            self.rim = scale * (width * (b + c))          # the four faces that the plane splits
            self.per_unit = 1 / (hi[axis] - lo[axis])
        self.lo, self.hi = lo[axis], hi[axis]
        self.traversal, self.bonus = np.float32(costs.traversal), costs.empty_bonus

    def at(self, plane: np.ndarray, left: np.ndarray, right: np.ndarray,
           node: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Return the costs of splits at planes, (..., k); inf for a plane outside its node.

        left, right : the number of references on each side of each plane
        node : the node of each plane; by default, index i on the last axis means node i
        """
        with np.errstate(invalid="ignore", over="ignore"):
            share = (plane - self.lo[node]) * self.per_unit[node]
            cost = self.cap[node] * (left + right)
            cost += self.rim[node] * (share * left + (1 - share) * right)
        cost += self.traversal
        thick = np.float32(WORTH_CUTTING)
        empty = ((left == 0) & (share >= thick)) | ((right == 0) & (share <= 1 - thick))
        cost = np.where(empty, cost * np.float32(1 - self.bonus), cost)
        inside = (plane > self.lo[node]) & (plane < self.hi[node])
        return np.where(inside, cost, np.float32(np.inf))


def best_splits(level: KdLevel, costs: Costs, split: str, bins: int, run: Run = map) -> Splits:
    """Return the best split of every node of the level. Nodes without references get no split.

    run : `map`, or a `map` on several threads
    """
    splits = Splits.none(len(level.count))
    starts = run_starts(level.count)

    # Parts share no nodes, so several threads may search at the same time.
    def search(part: tuple[np.ndarray, int]) -> None:
        nodes, size = part
        _few(level, nodes, starts[nodes], size, costs, splits)

    deque(run(search, of_like_length(level.count, FEW_SIZES, above=0)), maxlen=0)
    many = np.flatnonzero(level.count > FEW)
    if len(many):
        for nodes, index in _parts(many, starts, level.count):
            if split == "exact":
                _sorted(level, nodes, index, costs, splits)
            else:
                _binned(level, nodes, index, bins, costs, splits, run)
    return splits


def _parts(nodes: np.ndarray, starts: np.ndarray,
           count: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    for part in chunks(count[nodes], 1 << 18):
        some = nodes[part]
        yield some, expand(starts[some], count[some])


def _few(level: KdLevel, nodes: np.ndarray, starts: np.ndarray, size: int, costs: Costs,
         splits: Splits) -> None:
    """Search nodes of at most `size` references exactly: compare every box with every face."""
    slot = np.arange(size)[:, None]
    real = slot < level.count[nodes]
    index = np.where(real, starts + slot, 0)
    for axis in range(3):
        lo = np.where(real, level.box[axis].take(index), np.float32(np.inf))
        hi = np.where(real, level.box[3 + axis].take(index), np.float32(-np.inf))
        plane = np.concatenate([lo, hi])
        left = np.zeros(plane.shape, np.uint8)
        right = np.zeros(plane.shape, np.uint8)
        for i in range(size):
            left += lo[i] < plane
            right += hi[i] > plane
        cost = costs.split(level, nodes, axis).at(plane, left, right)
        best = cost.argmin(axis=0)[None]
        splits.offer(nodes, np.take_along_axis(cost, best, 0)[0], axis,
                     np.take_along_axis(plane, best, 0)[0])


def _binned(level: KdLevel, nodes: np.ndarray, index: np.ndarray, bins: int, costs: Costs,
            splits: Splits, run: Run) -> None:
    """Try planes at the ends of equal bins between the outermost faces of the references."""
    count = level.count[nodes]
    starts, node = run_starts(count), owners(count)
    steps = np.linspace(0, 1, bins + 1, dtype=np.float32)
    rows = node * (bins + 1)
    cells = len(nodes) * (bins + 1)

    def along(axis: int) -> tuple[np.ndarray, int, np.ndarray]:
        lo, hi = level.box[axis].take(index), level.box[3 + axis].take(index)
        low, high = np.minimum.reduceat(lo, starts), np.maximum.reduceat(hi, starts)
        with np.errstate(divide="ignore", over="ignore"):
            per_unit = np.where(high > low, np.float32(bins) / (high - low), 0)
        per_unit = np.where(np.isfinite(per_unit), per_unit, 0).astype(np.float32)
        origin, per_unit = low[node], per_unit[node]
        bin_lo = ((lo - origin) * per_unit).astype(np.int64).clip(0, bins)
        bin_hi = np.ceil((hi - origin) * per_unit).astype(np.int64).clip(0, bins)
        starting = np.bincount(rows + bin_lo, minlength=cells).reshape(-1, bins + 1)
        ending = np.bincount(rows + bin_hi, minlength=cells).reshape(-1, bins + 1)
        left = (np.cumsum(starting, axis=1) - starting).astype(np.float32)
        right = (count[:, None] - np.cumsum(ending, axis=1)).astype(np.float32)
        plane = low[:, None] + (high - low)[:, None] * steps
        plane[:, -1] = high
        cost = costs.split(level, nodes, axis).at(plane.T, left.T, right.T).T
        best = cost.argmin(axis=1)
        row = np.arange(len(nodes))
        return cost[row, best], axis, plane[row, best]

    for found in run(along, range(3)):
        splits.offer(nodes, *found)


def _sorted(level: KdLevel, nodes: np.ndarray, index: np.ndarray, costs: Costs,
            splits: Splits) -> None:
    """Try all faces of all references, sorted by node, coordinate and kind (lower or upper)."""
    count = level.count[nodes]
    node = owners(count).astype(np.uint64) << np.uint64(33)
    starts = 2 * run_starts(count)
    owner = owners(2 * count)
    before = starts[owner]
    for axis in range(3):
        # At equal coordinates, upper faces come first: a plane there separates the boxes that end
        # from the boxes that begin.
        keys = np.concatenate([
            node | (_ordered(level.box[axis].take(index)) << np.uint64(1)) | np.uint64(1),
            node | (_ordered(level.box[3 + axis].take(index)) << np.uint64(1))])
        keys.sort()
        is_lo = (keys & np.uint64(1)).astype(np.int64)
        plane = _unordered(keys >> np.uint64(1))
        lows = np.cumsum(is_lo) - is_lo             # number of lower faces before each face
        left = lows - lows[before]
        ends = np.arange(1, len(keys) + 1) - before - (left + is_lo)
        right = count[owner] - ends
        cost = costs.split(level, nodes, axis).at(
            plane, left.astype(np.float32), right.astype(np.float32), owner)
        lowest = np.minimum.reduceat(cost, starts)
        at = np.flatnonzero(cost == lowest[owner])
        best = at[np.searchsorted(at, starts)]
        splits.offer(nodes, lowest, axis, plane[best])


def _ordered(values: np.ndarray) -> np.ndarray:
    """Map floats to integers of the same order, uint64 below 2^32."""
    bits = (values + np.float32(0)).view(np.uint32)      # + 0 turns -0 into +0
    return np.where(bits >> 31, ~bits, bits | np.uint32(1 << 31)).astype(np.uint64)


def _unordered(keys: np.ndarray) -> np.ndarray:
    """Map the low 32 bits of keys back to floats; the inverse of `_ordered`."""
    bits = keys.astype(np.uint32)
    return np.where(bits >> 31, bits ^ np.uint32(1 << 31), ~bits).view(np.float32)
