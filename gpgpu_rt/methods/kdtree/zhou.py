"""Zhou's build: split large nodes in the middle, and small nodes by SAH on bit masks.

K. Zhou, Q. Hou, R. Wang, B. Guo, "Real-time KD-tree construction on graphics hardware", SIGGRAPH
Asia 2008 (Hachisuka's survey, section 5). The fragment programs of `gpu_build/zhou.py` give the
same tree: every value that decides a split is computed in float32, in the programs' order.

A reference is a triangle's entry in a node, with the box of the triangle's part in the node. A
large node has more than `small` references. Its split cuts off empty space on one side of the node
if this space exceeds the share `empty_cut` of the node's extent. Otherwise the split halves the
longest axis, and clips the triangles on both sides.

A small root is a small node whose parent is large, or the root of a small tree. For small nodes,
the six faces of each reference's box are the candidate planes. Masks of 64 bits, computed once for
each small root, mark the root's references left and right of each plane. A node below a small root
is stored as a mask of the root's references.

Departures from the paper: a split cuts off empty space on one side of a node, not on up to six
sides. A triangle is clipped only by the split plane, not by the six faces of the node. If the
middle of the longest axis separates no references, the split halves the axis whose middle
separates most. If no middle separates any, the split is futile; after `FUTILE` futile splits in
succession, the node becomes a leaf of any size. In small nodes, splits that cut off empty space
get the bonus of `sah`.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...accel.bounds import padding
from ...accel.options import in_range, refuse_unknown
from ...accel.runs import expand, owners, run_starts
from .sah import Costs, KdLevel
from .sah_growth import root_level, sah_costs
from .tree import LEAF, MOST_REFERENCES, LooseKdTree, depth_cap
from .zhou_small import SmallRoots, grow_small

MASK_BITS = 64
EMPTY_CUT = 0.25    # the value of Zhou et al. for ray tracing
FUTILE = 3          # limit on futile splits in succession: one per axis
# The default depth limit of large nodes is `depth_cap` plus this number, because halving needs
# more levels than SAH.
MORE_LEVELS = 8
# Default limit on the levels below a small root. More levels would add references but not shorten
# traversal.
SMALL_LEVELS = 8
SLACK = 2           # clipped parts are widened by this many paddings, for float32 errors
CHUNK = 1 << 18     # number of triangles that are clipped together


@dataclass(frozen=True)
class ZhouRules:
    """The rules for splitting nodes; see `build`.

    Attributes
    ----------
    max_depth, large_depth : the depth limit of all nodes, and of large nodes
    small_levels : the largest number of levels below a small root
    pad : the padding of triangles' boxes, world units
    """

    costs: Costs
    max_depth: int
    large_depth: int
    small_levels: int
    small: int
    empty_cut: np.float32
    pad: np.float32

    def levels_below(self, depth: int) -> int:
        """Return the largest number of levels below a small root at this depth."""
        return min(self.small_levels, self.max_depth - depth)

    @property
    def slack(self) -> np.float32:
        """The distance by which clipped parts are widened, world units."""
        return np.float32(SLACK) * self.pad


def rules_of(triangles: np.ndarray, *, traversal_cost: float = Costs.traversal,
             intersection_cost: float = Costs.intersection, empty_bonus: float = Costs.empty_bonus,
             max_depth: int | None = None, small: int = MASK_BITS,
             empty_cut: float = EMPTY_CUT, **unknown: object) -> ZhouRules:
    """Check the options of `build` and return the rules that they set."""
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
    traversal_cost, intersection_cost, empty_bonus : As in `sah_build.build`.
    max_depth : Largest depth of a leaf. None limits the depth of a large node to 16 + 1.3 log2 n,
        and the levels below a small root to 8.
    small : Largest number of references of a small node, up to 64.
    empty_cut : Empty space is cut off if it exceeds this share of a large node's extent.
    """
    rules = rules_of(triangles, **options)
    nodes = Nodes()
    roots = grow_large(root_level(triangles, rules.pad), triangles, rules, nodes)
    grow_small(roots, rules.costs, nodes)
    return nodes.loose()


class Nodes:
    """Collects nodes, parents before their children. Node 0 exists from the start."""

    def __init__(self) -> None:
        self.count = 1
        self.inner: list[tuple[np.ndarray, ...]] = []
        self.leaves: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []

    def split(self, node: np.ndarray, axis: np.ndarray,
              plane: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Make these nodes inner nodes. Return the indices of their left and right children."""
        first = self.count + 2 * np.arange(len(node))
        self.count += 2 * len(node)
        self.inner.append((node, axis, plane, first))
        return first, first + 1

    def leaf(self, node: np.ndarray, count: np.ndarray, triangle: np.ndarray) -> None:
        """Make these nodes leaves of `count` triangles each, listed leaf by leaf in `triangle`."""
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


def grow_large(level: KdLevel, triangles: np.ndarray, rules: ZhouRules,
               nodes: Nodes) -> SmallRoots:
    """Split the root, given as a level, and all large nodes below it. Return the small roots."""
    node, futile, depth = np.zeros(1, np.int64), np.zeros(1, np.int64), 0
    roots = SmallRoots()
    limit = MOST_REFERENCES * len(triangles) + 4096
    kept = 0            # number of references in small nodes and leaves
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


def pick(level: KdLevel, nodes: np.ndarray) -> KdLevel:
    """Return a level with only the given nodes and their references."""
    index = expand(run_starts(level.count)[nodes], level.count[nodes])
    return KdLevel(level.lo[:, nodes], level.hi[:, nodes], level.count[nodes],
                   level.triangle[index], level.box[:, index])


def decide(level: KdLevel, futile: np.ndarray,
           rules: ZhouRules) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Decide whether and where to split large nodes.

    Returns
    -------
    inner : (k,) bool, whether to split each of the k nodes
    axis : (k,) int8
    plane : (k,) float32
    futile : (k,) int64, the number of futile splits in succession
    """
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
    none = 2 * count            # the value of `both` if every reference lies on both sides
    both = np.where((middle > lo) & (middle < hi), both, none + 1)
    longest = (hi - lo).argmax(axis=0)
    chosen = np.where(both[longest, row] < none, longest, both.argmin(axis=0))
    found = both[chosen, row]
    futile = np.where(cut, futile, np.where(found < none, 0, futile + 1))
    inner = cut | ((found <= none) & (futile <= FUTILE))
    return (inner, np.where(cut, axis, chosen).astype(np.int8),
            np.where(cut, plane, middle[chosen, row]), futile)


def large_children(level: KdLevel, axis: np.ndarray, plane: np.ndarray, triangles: np.ndarray,
                   slack: np.float32) -> KdLevel:
    """Return the children of a level: all left children, then all right children."""
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
    return KdLevel(*(np.concatenate(pair, axis=-1) for pair in zip(*parts)))


def clip_half(triangles: np.ndarray, index: np.ndarray, axis: np.ndarray, plane: np.ndarray,
              side: int, slack: np.float32, box: np.ndarray) -> np.ndarray:
    """Clip each triangle by a plane. Return the boxes of the remaining parts within the old boxes.

    Parameters
    ----------
    index, axis, plane : (m,), the triangle, and the axis and coordinate of the plane that cuts it
    side : 0 keeps the part below the plane, 1 the part above the plane
    slack : distance in world units by which the plane is shifted, to keep more, and by which the
        kept part's box is widened. It exceeds twice the error of new vertices, which is at most
        12 u M: u is the unit roundoff, M the scene's largest coordinate
    box : (6, m) float32, the lower and the upper corner of each old box

    Returns
    -------
    (6, m) float32. If no part of a triangle is left, the lower corner lies above the upper corner
    """
    result = np.empty_like(box)
    for begin in range(0, len(index), CHUNK):
        some = slice(begin, begin + CHUNK)
        result[:, some] = _clip_half(triangles[index[some]].transpose(1, 2, 0), axis[some],
                                     plane[some], side, slack, box[:, some])
    return result


def _clip_half(vertices: np.ndarray, axis: np.ndarray, plane: np.ndarray, side: int,
               slack: np.float32, box: np.ndarray) -> np.ndarray:
    """Clip a chunk of triangles for `clip_half`. `vertices` is (vertex, coordinate, triangle)."""
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
