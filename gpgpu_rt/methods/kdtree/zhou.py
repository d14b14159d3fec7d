"""Zhou's build: large nodes at their middle, small ones by the surface area heuristic on masks.

K. Zhou, Q. Hou, R. Wang, B. Guo, "Real-time KD-tree construction on graphics hardware", SIGGRAPH
Asia 2008 (survey, section 5). The numpy form, which defines the tree: the
fragment programs of `gpu_build/zhou.py` give the same one, node for node. So all that decides is
computed in float32, in the order that the programs have.

A large node (more than `small` references) loses empty space on a side where there is more than
`empty_cut` of its extent; otherwise it is split in the middle of its longest axis, and references
on both sides are clipped. A small one chooses among the six sides of each reference's box; which
references lie left and right of each is held in masks of 64 bits, made once a small root, and a
node below it is such a mask.

Departures: a node loses space on one side a level, not on six. A reference is clipped by the plane
alone and cut to the box that it had, not to the node's six sides: three edges instead of a
polygon. Where the longest axis has every reference on both sides of its middle, another axis is
taken that has not; after `FUTILE` levels without one the node is a leaf, however large. An empty
part of a small node wins the bonus of `sah`.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...accel.bounds import padding
from ...accel.options import in_range, refuse_unknown
from ...accel.runs import expand, owners, run_starts
from .sah import Costs, Level
from .sah_growth import root_level, sah_costs
from .tree import LEAF, MOST_REFERENCES, LooseKdTree, depth_cap
from .zhou_small import SmallRoots, grow_small

MASK_BITS = 64
EMPTY_CUT = 0.25    # Zhou et al. for ray tracing
FUTILE = 3          # levels, one an axis
MORE_LEVELS = 8     # of large nodes than `depth_cap`: halves get less far than planes weighed
SMALL_LEVELS = 8    # below a small root; more make long lists and no shorter ways
SLACK = 2           # paddings around a clipped part: the clip is in float32
CHUNK = 1 << 18


@dataclass(frozen=True)
class ZhouRules:
    """How nodes are split: see `build`.

    max_depth, large_depth : of any node, and of one that is still large
    small_levels : below a small root
    pad : of triangles' boxes, world units
    """

    costs: Costs
    max_depth: int
    large_depth: int
    small_levels: int
    small: int
    empty_cut: np.float32
    pad: np.float32

    def levels_below(self, depth: int) -> int:
        """How many levels there may be below a small root of this depth."""
        return min(self.small_levels, self.max_depth - depth)

    @property
    def slack(self) -> np.float32:
        """Around clipped parts, world units."""
        return np.float32(SLACK) * self.pad


def rules_of(triangles: np.ndarray, *, traversal_cost: float = Costs.traversal,
             intersection_cost: float = Costs.intersection, empty_bonus: float = Costs.empty_bonus,
             max_depth: int | None = None, small: int = MASK_BITS,
             empty_cut: float = EMPTY_CUT, **unknown: object) -> ZhouRules:
    """The options of `build`, checked."""
    refuse_unknown(rules_of, unknown)
    large = below = deepest = depth_cap(triangles, max_depth)
    if max_depth is None:
        large, below = large + MORE_LEVELS, SMALL_LEVELS
        deepest = large + below
    return ZhouRules(sah_costs(traversal_cost, intersection_cost, empty_bonus),
                     deepest, large, below, in_range("small", small, 1, MASK_BITS, int),
                     np.float32(in_range("empty_cut", empty_cut, 0, 1)), padding(triangles))


def build(triangles: np.ndarray, **options: object) -> LooseKdTree:
    """Build as Zhou et al. do.

    Parameters
    ----------
    traversal_cost, intersection_cost, empty_bonus : as in `sah_kdtree.build`
    max_depth : None for 16 + 1.3 log2 n to a small node, and 8 below it
    small : most references of a small node, up to 64
    empty_cut : share of a large node's extent past which empty space is cut off
    """
    rules = rules_of(triangles, **options)
    nodes = Nodes()
    roots = grow_large(root_level(triangles, rules.pad), triangles, rules, nodes)
    grow_small(roots, rules.costs, nodes)
    return nodes.loose()


class Nodes:
    """Collects nodes, parents before their children; node 0 is there from the start."""

    def __init__(self) -> None:
        self.count = 1
        self.inner: list[tuple[np.ndarray, ...]] = []
        self.leaves: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []

    def split(self, node: np.ndarray, axis: np.ndarray,
              plane: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Make these nodes inner ones; the numbers of their left and right children."""
        first = self.count + 2 * np.arange(len(node))
        self.count += 2 * len(node)
        self.inner.append((node, axis, plane, first))
        return first, first + 1

    def leaf(self, node: np.ndarray, count: np.ndarray, triangle: np.ndarray) -> None:
        """Make these nodes leaves, their triangles one leaf after another."""
        self.leaves.append((node, count, triangle))

    def loose(self) -> LooseKdTree:
        axis, plane = np.full(self.count, LEAF, np.int8), np.zeros(self.count, np.float32)
        first, count = np.full(self.count, -1, np.int64), np.zeros(self.count, np.int64)
        start = np.zeros(self.count, np.int64)
        for node, axes, planes, left in self.inner:
            axis[node], plane[node], first[node] = axes, planes, left
        leaf, counts, triangles = map(np.concatenate, zip(*self.leaves))
        count[leaf], start[leaf] = counts, run_starts(counts)
        return LooseKdTree(axis, plane, first, np.where(first < 0, -1, first + 1), start, count,
                           triangles.astype(np.int32))


# Large nodes -------------------------------------------------------------------------------------


def grow_large(level: Level, triangles: np.ndarray, rules: ZhouRules, nodes: Nodes) -> SmallRoots:
    """Split a level of one node, and all below it, as long as they are large; the small ones."""
    node, futile, depth = np.zeros(1, np.int64), np.zeros(1, np.int64), 0
    roots = SmallRoots()
    limit = MOST_REFERENCES * len(triangles) + 4096
    kept = 0            # references of small nodes and of leaves
    while True:
        large = level.count > rules.small
        few = np.flatnonzero(~large & (level.count > 0))
        roots.add(pick(level, few), node[few], rules.levels_below(depth))
        kept += int(level.count[few].sum())
        none = node[level.count == 0]
        nodes.leaf(none, np.zeros(len(none), np.int64), np.zeros(0, np.int32))
        large = np.flatnonzero(large)
        level, node, futile = pick(level, large), node[large], futile[large]
        if not len(node):
            return roots
        inner = np.zeros(len(node), bool)
        if depth < rules.large_depth and kept + len(level.triangle) <= limit:
            inner, axis, plane, futile = decide(level, futile, rules)
        leaf, inner = np.flatnonzero(~inner), np.flatnonzero(inner)
        leaves = pick(level, leaf)
        nodes.leaf(node[leaf], leaves.count, leaves.triangle)
        kept += len(leaves.triangle)
        if not len(inner):
            return roots
        axis, plane, futile = axis[inner], plane[inner], np.tile(futile[inner], 2)
        node = np.concatenate(nodes.split(node[inner], axis, plane))
        level = large_children(pick(level, inner), axis, plane, triangles, rules.slack)
        depth += 1


def pick(level: Level, nodes: np.ndarray) -> Level:
    """Some of a level's nodes, with their references."""
    index = expand(run_starts(level.count)[nodes], level.count[nodes])
    return Level(level.lo[:, nodes], level.hi[:, nodes], level.count[nodes],
                 level.triangle[index], level.box[:, index])


def decide(level: Level, futile: np.ndarray,
           rules: ZhouRules) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """For large nodes: whether to split, along which axis, where, and how many levels now have
    not told any reference from another."""
    lo, hi, count = level.lo, level.hi, level.count
    starts, owner, row = run_starts(count), owners(count), np.arange(len(count))
    tight = np.concatenate([np.minimum.reduceat(level.box[:3], starts, axis=1),
                            np.maximum.reduceat(level.box[3:], starts, axis=1)])
    with np.errstate(all="ignore"):
        gap = np.concatenate([tight[:3] - lo, hi - tight[3:]]) / np.tile(hi - lo, (2, 1))
    side = gap.argmax(axis=0)
    plane, axis = tight[side, row], side % 3
    cut = gap[side, row] > rules.empty_cut
    cut &= (plane > lo[axis, row]) & (plane < hi[axis, row])
    middle = lo + np.float32(0.5) * (hi - lo)
    at = middle[:, owner]
    left = (level.box[:3] < at) | (level.box[3:] <= at)
    both = (np.add.reduceat(left, starts, axis=1, dtype=np.int64)
            + np.add.reduceat(level.box[3:] > at, starts, axis=1, dtype=np.int64))
    none = 2 * count            # on both sides, all of them
    both = np.where((middle > lo) & (middle < hi), both, none + 1)
    longest = (hi - lo).argmax(axis=0)
    chosen = np.where(both[longest, row] < none, longest, both.argmin(axis=0))
    found = both[chosen, row]
    futile = np.where(cut, futile, np.where(found < none, 0, futile + 1))
    inner = cut | ((found <= none) & (futile <= FUTILE))
    return (inner, np.where(cut, axis, chosen).astype(np.int8),
            np.where(cut, plane, middle[chosen, row]), futile)


def large_children(level: Level, axis: np.ndarray, plane: np.ndarray, triangles: np.ndarray,
                   slack: np.float32) -> Level:
    """The children of all nodes of a level: the left ones, then the right ones."""
    owner, index = owners(level.count), np.arange(len(level.triangle))
    row = axis.astype(np.int64)[owner]
    cut = plane[owner]
    lo, hi = level.box[row, index], level.box[row + 3, index]
    on_left, on_right = (lo < cut) | (hi <= cut), hi > cut
    parts = []
    for side, here, there in ((0, on_left, on_right), (1, on_right, on_left)):
        kept = np.flatnonzero(here)
        across = there[kept]
        box = level.box[:, kept]
        box[:, across] = clip_half(triangles, level.triangle[kept[across]], row[kept[across]],
                                   cut[kept[across]], side, slack, box[:, across])
        whole = (box[:3] <= box[3:]).all(axis=0)
        kept, box = kept[whole], box[:, whole]
        node_lo, node_hi = level.lo.copy(), level.hi.copy()
        (node_hi, node_lo)[side][axis, np.arange(len(axis))] = plane
        parts.append((node_lo, node_hi, np.bincount(owner[kept], minlength=len(axis)),
                      level.triangle[kept], box))
    return Level(*(np.concatenate(pair, axis=-1) for pair in zip(*parts)))


def clip_half(triangles: np.ndarray, index: np.ndarray, axis: np.ndarray, plane: np.ndarray,
              side: int, slack: np.float32, box: np.ndarray) -> np.ndarray:
    """Boxes of the parts of triangles on one side of a plane each, within the boxes they had.

    Parameters
    ----------
    index, axis, plane : (m,), the triangle, and the plane that cuts it
    side : 0 keeps what lies below the plane, 1 what lies above
    slack : that both the plane and the part are widened by. Of a vertex made by the cut every
        coordinate is wrong by at most 12 roundings of the scene's largest, less than half of it
    box : (6, m) float32, the lower and the upper corner

    Returns
    -------
    (6, m) float32; lower corners above the upper ones where nothing is left
    """
    result = np.empty_like(box)
    for begin in range(0, len(index), CHUNK):
        some = slice(begin, begin + CHUNK)
        result[:, some] = _clip_half(triangles[index[some]].transpose(1, 2, 0), axis[some],
                                     plane[some], side, slack, box[:, some])
    return result


def _clip_half(vertices: np.ndarray, axis: np.ndarray, plane: np.ndarray, side: int,
               slack: np.float32, box: np.ndarray) -> np.ndarray:
    """vertices : (3, 3, m), vertex, coordinate, triangle."""
    row = np.arange(len(axis))
    wide = plane - slack if side else plane + slack
    along = vertices[:, axis, row]
    inside = along >= wide if side else along <= wide
    lo, hi = np.full_like(box[:3], np.inf), np.full_like(box[:3], -np.inf)

    def include(where: np.ndarray, point: np.ndarray) -> None:
        np.minimum(lo, np.where(where, point, np.float32(np.inf)), out=lo)
        np.maximum(hi, np.where(where, point, np.float32(-np.inf)), out=hi)
    for i in range(3):
        j = (i + 1) % 3
        include(inside[i], vertices[i])
        with np.errstate(all="ignore"):
            share = (wide - along[i]) / (along[j] - along[i])
            point = vertices[i] + share * (vertices[j] - vertices[i])
        include(inside[i] != inside[j], point)
    part = np.concatenate([np.maximum(lo - slack, box[:3]), np.minimum(hi + slack, box[3:])])
    edge = axis + 3 * (1 - side)
    part[edge, row] = (np.maximum if side else np.minimum)(part[edge, row], plane)
    return part
