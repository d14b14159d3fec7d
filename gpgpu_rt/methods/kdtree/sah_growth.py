"""SAH growth: grows a kd-tree level by level. All nodes of a level are split together."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...accel.bounds import scene_box, triangle_boxes
from ...accel.clip import clip_bounds
from ...accel.options import in_range
from ...accel.runs import expand, owners, run_starts
from ...threads import Run
from .sah import Costs, KdLevel, best_splits
from .tree import LEAF, MOST_REFERENCES, LooseKdTree


def sah_costs(traversal_cost: float, intersection_cost: float, empty_bonus: float) -> Costs:
    """Check and return the constants of the surface area heuristic."""
    return Costs(in_range("traversal_cost", traversal_cost, 0, 1e6),
                 in_range("intersection_cost", intersection_cost, 1e-6, 1e6),
                 in_range("empty_bonus", empty_bonus, 0, 0.999))


@dataclass(frozen=True)
class Rules:
    """The rules for splitting nodes; see `sah_build.build` for costs, split, bins and max_depth.

    Attributes
    ----------
    pad : the padding of boxes, world units
    """

    costs: Costs
    split: str
    bins: int
    max_depth: int
    pad: np.float32


def grow(level: KdLevel, depth: int, vertices: np.ndarray | None, rules: Rules,
         enough: int | None = None, run: Run = map) -> tuple[GrownNodes, KdLevel | None]:
    """Split a level, and the levels below it, until no split lowers the cost.

    The limits `max_depth` and `MOST_REFERENCES` may end the growth earlier.

    Parameters
    ----------
    depth : depth of the level
    vertices : (3, 3, n) float32, indexed by vertex, axis and triangle: a triangle that lies on
        both sides of a split is clipped to each child. None: only the triangle's box is cut
    enough : stop before the first level with at least this many nodes; None never stops early

    Returns
    -------
    the nodes so far, and the level that remains to be split, or None if no level remains
    """
    grown = GrownNodes()
    limit = MOST_REFERENCES * len(level.triangle) + 4096
    while enough is None or len(level.count) < enough:
        nodes = np.zeros(0, np.int64)
        if depth < rules.max_depth and grown.kept + len(level.triangle) <= limit:
            best = best_splits(level, rules.costs, rules.split, rules.bins, run)
            nodes = np.flatnonzero(best.cost < rules.costs.intersection * level.count)
        if not len(nodes):
            grown.add(level, nodes)
            return grown, None
        axis, plane = best.axis[nodes], best.plane[nodes]
        grown.add(level, nodes, axis, plane)
        level = children(level, nodes, axis, plane, vertices, rules.pad, run)
        depth += 1
    return grown, level


def root_level(triangles: np.ndarray, pad: np.float32) -> KdLevel:
    """Return a level of one node that holds the whole scene."""
    lo, hi = scene_box(triangles)
    box_lo, box_hi = triangle_boxes(triangles)
    return KdLevel(lo[:, None], hi[:, None], np.array([len(triangles)]),
                   np.arange(len(triangles), dtype=np.int32),
                   np.concatenate([box_lo - pad, box_hi + pad]))


def children(level: KdLevel, nodes: np.ndarray, axis: np.ndarray, plane: np.ndarray,
             vertices: np.ndarray | None, pad: np.float32, run: Run = map) -> KdLevel:
    """Return the children of the given nodes: all left children, then all right children."""
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
    parts = run(lambda one: _child(level, index, owner, across, *one, vertices, pad), sides)
    joined = [np.concatenate(pair, axis=-1) for pair in zip(*parts)]
    return KdLevel(*joined)


def _child(level: KdLevel, index: np.ndarray, owner: np.ndarray, across: np.ndarray,
           side: np.ndarray, lo: np.ndarray, hi: np.ndarray, vertices: np.ndarray | None,
           pad: np.float32) -> tuple[np.ndarray, ...]:
    """Return the children on one side of every split node, as the fields of a level.

    across : positions in `index` of the references on both sides, which need clipping
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


class GrownNodes:
    """Collects the nodes of a tree level by level."""

    def __init__(self) -> None:
        self.fields: list[tuple[np.ndarray, ...]] = []
        self.references: list[np.ndarray] = []
        self.nodes = self.kept = 0

    def add(self, level: KdLevel, inner: np.ndarray, axis: np.ndarray | None = None,
            plane: np.ndarray | None = None) -> None:
        """Append a level. `axis` and `plane` are the splits of its `inner` nodes.

        The next level must be their children: all left children, then all right children.
        """
        n, split_count = len(level.count), len(inner)
        axes, planes = np.full(n, LEAF, np.int8), np.zeros(n, np.float32)
        first, second = np.full(n, -1, np.int64), np.full(n, -1, np.int64)
        count = level.count.copy()
        if split_count:
            axes[inner], planes[inner], count[inner] = axis, plane, 0
            first[inner] = self.nodes + n + np.arange(split_count)
            second[inner] = first[inner] + split_count
        leaves = np.flatnonzero(first < 0)
        index = expand(run_starts(level.count)[leaves], level.count[leaves])
        self.references.append(level.triangle[index])
        self.fields.append((axes, planes, first, second, count))
        self.nodes += n
        self.kept += len(index)

    def loose(self) -> LooseKdTree:
        axis, plane, first, second, count = map(np.concatenate, zip(*self.fields))
        return LooseKdTree(axis, plane, first, second, run_starts(count), count,
                           np.concatenate(self.references))
