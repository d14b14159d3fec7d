"""SAH build: builds a bounding volume hierarchy by the surface area heuristic (SAH), with bins.

As in I. Wald, "On fast construction of SAH-based bounding volume hierarchies", 2007, equal bins
divide the range between the outermost centroids. In nodes with few triangles, every split between
two triangles is tried (a sweep), as in I. Wald, S. Boulos, P. Shirley, "Ray tracing deformable
scenes using dynamic bounding volume hierarchies", 2007. All three axes are tried. A node is split
at the median triangle if its bins give no split, or if its subtree could exceed the depth cap.
"""
from __future__ import annotations

import numpy as np

from ...accel.bounds import half_area
from ...accel.options import in_range, refuse_unknown
from ...accel.runs import chunks, expand, of_like_length, owners, run_starts
from ...threads import Run, threads
from . import top_down
from .top_down import TriangleLevel
from .tree import MAX_LEAF, LooseTree

FEW = 12                        # nodes of at most this many triangles are swept
# Nodes of similar size are swept together. These are the largest sizes of the groups.
FEW_SIZES = (2, 3, 4, 6, 8, FEW)
ITEM_CHUNK = 1 << 17            # approximate number of triangles that are binned together


def build(triangles: np.ndarray, *, bins: int = 32, max_leaf: int = MAX_LEAF,
          traversal_cost: float = 1.0, intersection_cost: float = 1.0, max_depth: int = 64,
          **unknown: object) -> LooseTree:
    """Build by SAH splits. A node of at most `max_leaf` triangles becomes a leaf if no split
    lowers the cost.

    Parameters
    ----------
    bins : number of bins along each axis
    traversal_cost, intersection_cost : cost of a node and of a triangle, in any common unit
    max_depth : limit on the depth; a limit below ceil(log2 n) acts as ceil(log2 n). A node whose
        subtree could exceed the limit is split at the median triangle
    """
    refuse_unknown(build, unknown)
    return top_down.build(triangles, splitter(
        bins=bins, max_leaf=max_leaf, traversal_cost=traversal_cost,
        intersection_cost=intersection_cost, max_depth=max_depth, run=threads(len(triangles))))


def splitter(*, bins: int = 32, max_leaf: int = MAX_LEAF, traversal_cost: float = 1.0,
             intersection_cost: float = 1.0, max_depth: int = 64, run: Run = map,
             **unknown: object) -> top_down.Splitter:
    """Return a function that splits a level's nodes by SAH.

    run : a function such as `map`, which applies a function to the parts of a level
    other parameters : as in `build`
    """
    refuse_unknown(splitter, unknown)
    bins = in_range("bins", bins, 2, 1024, int)
    max_leaf = in_range("max_leaf", max_leaf, 1, 1 << 20, int)
    traversal = in_range("traversal_cost", traversal_cost, 0, 1e6)
    intersection = in_range("intersection_cost", intersection_cost, 1e-6, 1e6)
    max_depth = in_range("max_depth", max_depth, 0, 1024, int)

    def split(level: TriangleLevel) -> tuple[np.ndarray, np.ndarray]:
        cost, axis, taken = _best(level, bins, run)
        count = level.count
        halved = (taken == 0) | (level.depth + np.ceil(np.log2(count)) >= max_depth)
        axis = np.where(halved, level.extents().argmax(axis=0), axis)
        taken = np.where(halved, count // 2, taken)
        leaf = (count <= max_leaf) & (intersection * count <= 2 * traversal + intersection * cost)
        return axis, np.where(leaf | (count < 2), 0, taken)

    return split


def _best(level: TriangleLevel, bins: int, run: Run) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the cost, axis and number of left triangles of each node's cheapest split.

    cost = (left area * left triangles + right area * right triangles) / the node's area. Without a
    split, the number of left triangles is 0.
    """
    nodes = len(level.count)
    cost = np.full(nodes, np.inf, np.float32)
    axis = np.zeros(nodes, np.int64)
    taken = np.zeros(nodes, np.int64)
    starts = run_starts(level.count)

    def offer(some: np.ndarray, a: int, new: np.ndarray, left: np.ndarray) -> None:
        better = np.flatnonzero(new < cost[some])
        cost[some[better]], axis[some[better]], taken[some[better]] = new[better], a, left[better]

    # A part: nodes, and their largest number of triangles; 0 if they are binned.
    parts = of_like_length(level.count, FEW_SIZES, above=1)
    large = np.flatnonzero(level.count > FEW)
    parts += [(large[part], 0) for part in chunks(level.count[large], ITEM_CHUNK)]

    def along(task: tuple[np.ndarray, int, int]) -> tuple[np.ndarray, np.ndarray]:
        some, size, a = task
        if size:
            return _swept(level, a, starts[some], level.count[some], size)
        return _binned(level, a, expand(starts[some], level.count[some]), level.count[some], bins)

    tasks = [(some, size, a) for some, size in parts for a in range(3)]
    for (some, _, a), found in zip(tasks, run(along, tasks)):
        offer(some, a, *found)
    return cost, axis, taken


def _cheapest(left: np.ndarray, right: np.ndarray, taken: np.ndarray,
              count: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the cost of each node's cheapest split, (k,), and the split's `taken`, (k,).

    Each of the k nodes has p splits.

    Parameters
    ----------
    left, right : (p, k), the half areas of the two sides
    taken : (p, k), the number of triangles that go left
    count : (k,), the number of triangles of each node
    """
    root = np.maximum(left[-1], np.float32(1e-37))
    cost = (left / root) * taken + (right / root) * (count - taken)
    cost = np.where((taken > 0) & (taken < count), cost, np.float32(np.inf))
    best = cost.argmin(axis=0)[None]
    return np.take_along_axis(cost, best, 0)[0], np.take_along_axis(taken, best, 0)[0]


def _swept(level: TriangleLevel, a: int, starts: np.ndarray, count: np.ndarray,
           size: int) -> tuple[np.ndarray, np.ndarray]:
    """Try all splits between neighbours along axis `a`, for nodes of at most `size` triangles."""
    slot = np.arange(size)[:, None]
    # Slots past the end of a node repeat the node's last triangle, which changes no box.
    triangle = level.order[a][starts + np.minimum(slot, count - 1)]
    lo, hi = level.lo[:, triangle], level.hi[:, triangle]
    left = half_area(np.minimum.accumulate(lo, axis=1), np.maximum.accumulate(hi, axis=1))
    right = np.zeros_like(left)
    right[:-1] = half_area(np.minimum.accumulate(lo[:, :0:-1], axis=1),
                           np.maximum.accumulate(hi[:, :0:-1], axis=1))[::-1]
    taken = np.broadcast_to(slot + 1, left.shape)
    return _cheapest(left, right, taken, count)


def _binned(level: TriangleLevel, a: int, index: np.ndarray, count: np.ndarray,
            bins: int) -> tuple[np.ndarray, np.ndarray]:
    """Try a split at the end of each bin. Equal bins divide the range of centroids along `a`."""
    node, starts = owners(count), run_starts(count)
    triangle = level.order[a][index]
    where = level.centroid[a][triangle]
    low, high = where[starts], where[starts + count - 1]
    with np.errstate(divide="ignore", over="ignore"):
        per_unit = np.where(high > low, np.float32(bins) / (high - low), 0)
    per_unit = np.where(np.isfinite(per_unit), per_unit, 0).astype(np.float32)
    bin_ = ((where - low[node]) * per_unit[node]).astype(np.int64).clip(0, bins - 1)
    cell = node * bins + bin_           # ascending, because `order` sorts the triangles along `a`
    runs = np.flatnonzero(np.diff(cell, prepend=-1))
    shape = (3, len(count), bins)
    lo = np.full(shape, np.inf, np.float32)
    hi = np.full(shape, -np.inf, np.float32)
    used = cell[runs]
    lo.reshape(3, -1)[:, used] = np.minimum.reduceat(level.lo[:, triangle], runs, axis=1)
    hi.reshape(3, -1)[:, used] = np.maximum.reduceat(level.hi[:, triangle], runs, axis=1)
    held = np.bincount(used, np.diff(runs, append=len(cell)), len(count) * bins)
    taken = np.cumsum(held.reshape(-1, bins).astype(np.int64), axis=1)
    left = half_area(np.minimum.accumulate(lo, axis=2), np.maximum.accumulate(hi, axis=2))
    right = np.zeros_like(left)
    right[:, :-1] = half_area(np.minimum.accumulate(lo[..., :0:-1], axis=2),
                              np.maximum.accumulate(hi[..., :0:-1], axis=2))[:, ::-1]
    return _cheapest(left.T, right.T, taken.T, count)
