"""Bounding interval hierarchy: the tree, and its build by halving cells.

C. Waechter, A. Keller, "Instant ray tracing: the bounding interval hierarchy", EGSR 2006. A node
holds an axis and two planes: the end of its left child and the start of its right child. Each node
has a cell; the root's cell contains the centres of all triangles' boxes. The build halves a cell
across its longest side and assigns triangles by the centres of their boxes. If one half has no
triangles, the build makes no node and halves the other half again.

Departures: all nodes of a level are split together, not one by one in place. Near the depth cap,
and where all centres coincide, a node is split into two halves of equally many triangles.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...accel import tree_order
from ...accel.bounds import as_triangles, triangle_boxes
from ...accel.options import in_range, refuse_unknown
from ...accel.runs import expand, owners, run_starts
from ...accel.sound import alike, are_pairs, each_once, named

LEAF = 3            # the axis of a leaf
# Limit on halvings of a cell across one axis. Scaled centres lie between -1 and 1 and are
# multiples of 2^-149, so about 150 halvings separate any two.
HALVINGS = 160


@dataclass(frozen=True)
class Bih:
    """A binary tree. Node 0 is the root, and a right child directly follows the left child.

    Attributes
    ----------
    lo, hi : (3,) float32, the box of the triangles, world units
    axis : (n,) int8, 0, 1, 2, or 3 for a leaf
    left_hi, right_lo : (n,) float32, along the axis, the end of an inner node's left child and
        the start of the right child; 0 for a leaf
    child : (n,) int32, the left child of an inner node (the right child follows), or a leaf's
        first triangle in `order`
    count : (n,) int32, the number of triangles of a leaf; 0 for an inner node
    order : (m,) int32, the triangles, leaf by leaf; ascending within a leaf
    depth : int, the number of edges from the root to the deepest leaf
    """

    lo: np.ndarray
    hi: np.ndarray
    axis: np.ndarray
    left_hi: np.ndarray
    right_lo: np.ndarray
    child: np.ndarray
    count: np.ndarray
    order: np.ndarray
    depth: int

    def parents(self) -> np.ndarray:
        """Return each node's parent, (n,) int32; -1 for the root."""
        return tree_order.pair_parents(self.child, self.axis != LEAF)

    def boxes(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and upper corners of each node's box, (n, 3) float32 each.

        A node's box is the scene's box cut by the planes of all ancestors.
        """
        lo = np.tile(self.lo, (len(self.axis), 1))
        hi = np.tile(self.hi, (len(self.axis), 1))
        inner = self.axis != LEAF
        first = np.where(inner, self.child, -1)
        second = np.where(inner, self.child + 1, -1)
        for nodes in tree_order.inner_levels(first, second) if len(first) else []:
            one, two, axis = first[nodes], second[nodes], self.axis[nodes]
            lo[one] = lo[two] = lo[nodes]
            hi[one] = hi[two] = hi[nodes]
            # A child's box must not extend beyond its parent's box.
            hi[one, axis] = np.minimum(self.left_hi[nodes], hi[nodes, axis])
            lo[two, axis] = np.maximum(self.right_lo[nodes], lo[nodes, axis])
        return lo, hi

    def is_sound(self, triangles: int) -> bool:
        """Whether the arrays are valid for ``triangles`` triangles; see ``accel/sound.py``."""
        n = len(self.axis)
        return (alike(named(self, "lo hi"), "f", 3)
                and alike(named(self, "left_hi right_lo"), "f", n)
                and alike(named(self, "axis child count"), "i", n)
                and each_once(self.order, triangles)
                and (are_pairs(self.axis, self.child, self.count, triangles, self.depth) if n
                     else triangles == 0))


def build_bih(triangles: np.ndarray, *, max_leaf: int = 4, max_depth: int = 64,
              **unknown: object) -> Bih:
    """Build a bounding interval hierarchy.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units
    max_leaf : the largest number of triangles in a leaf
    max_depth : limit on the depth; a limit below ceil(log2 n) acts as ceil(log2 n). A node whose
        subtree could exceed the limit is split into halves of equally many triangles

    Raises
    ------
    OptionError, SceneError
    """
    refuse_unknown(build_bih, unknown)
    max_leaf = in_range("max_leaf", max_leaf, 1, 1 << 20, int)
    max_depth = in_range("max_depth", max_depth, 0, 1024, int)
    triangles = as_triangles(triangles)
    box_lo, box_hi = triangle_boxes(triangles)
    # Scale by a power of two, which is exact, so that box centres never overflow.
    _, exponent = np.frexp(np.abs(triangles).max(initial=0))
    middle = np.ldexp(box_lo, -exponent) * np.float32(0.5)
    middle += np.ldexp(box_hi, -exponent) * np.float32(0.5)
    order = np.arange(len(triangles), dtype=np.int32)
    count = np.array([len(triangles)] if len(triangles) else [], np.int64)
    cell_lo = middle.min(axis=1, initial=0).astype(np.float64)[:, None]
    cell_hi = middle.max(axis=1, initial=0).astype(np.float64)[:, None]
    nodes, depth = _BihNodes(box_lo, box_hi), 0
    while len(count):
        starts = run_starts(count)
        inner = np.flatnonzero(count > max_leaf)
        nodes.add(order, count, starts, inner)
        if not len(inner):
            break
        index = expand(starts[inner], count[inner])
        order, count = order[index], count[inner]
        node, starts = owners(count), run_starts(count)
        axis, plane, cells = _planes(cell_lo[:, inner], cell_hi[:, inner],
                                     *_spread(middle, order, starts))
        where = middle[axis[node], order]
        left = where < plane[node]
        halved = np.isnan(plane) | (depth + np.ceil(np.log2(count)) >= max_depth)
        by_count = halved[node]
        left[by_count] = (np.arange(len(order)) - starts[node] < count[node] // 2)[by_count]
        nodes.split(axis, order, starts, left)
        cell_lo, cell_hi = cells
        taken = np.add.reduceat(left, starts, dtype=np.int64)
        order = np.concatenate([order[left], order[~left]])    # ascending in each node
        count = np.concatenate([taken, count - taken])
        depth += 1
    return nodes.finish(depth)


def _spread(middle: np.ndarray, order: np.ndarray,
            starts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest box centres in each of k nodes, (3, k) float64 each."""
    where = [middle[a][order] for a in range(3)]
    return tuple(np.stack([bound.reduceat(w, starts) for w in where]).astype(np.float64)
                 for bound in (np.minimum, np.maximum))


def _planes(cell_lo: np.ndarray, cell_hi: np.ndarray, lowest: np.ndarray, highest: np.ndarray
            ) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Choose a split plane for each cell.

    Parameters
    ----------
    cell_lo, cell_hi : (3, k), the cells
    lowest, highest : (3, k), the range of each cell's box centres; a plane must divide it

    Returns
    -------
    axis : (k,)
    plane : (k,), NaN where no plane separates the centres
    corners : lower and upper corners of the children's cells, (3, 2 k) each; all left children
        come first
    """
    cell_lo, cell_hi = cell_lo.copy(), cell_hi.copy()
    axis, plane = np.zeros(cell_lo.shape[1], np.int64), np.full(cell_lo.shape[1], np.nan)
    open_ = np.flatnonzero((lowest < highest).any(axis=0))
    for _ in range(3 * HALVINGS):
        if not len(open_):
            break
        a = (cell_hi[:, open_] - cell_lo[:, open_]).argmax(axis=0)
        at = (cell_lo[a, open_] + cell_hi[a, open_]) / 2
        below, above = highest[a, open_] < at, lowest[a, open_] >= at
        axis[open_] = a
        parts = ~below & ~above
        plane[open_[parts]] = at[parts]
        cell_hi[a[below], open_[below]] = at[below]
        cell_lo[a[above], open_[above]] = at[above]
        open_ = open_[~parts]
    pick = np.arange(len(axis))
    left_hi, right_lo = cell_hi.copy(), cell_lo.copy()
    parted = np.flatnonzero(~np.isnan(plane))
    left_hi[axis[parted], pick[parted]] = right_lo[axis[parted], pick[parted]] = plane[parted]
    return axis, plane, (np.concatenate([cell_lo, right_lo], axis=1),
                         np.concatenate([left_hi, cell_hi], axis=1))


class _BihNodes:
    """Collects the nodes level by level; `finish` puts them into depth-first order."""

    def __init__(self, box_lo: np.ndarray, box_hi: np.ndarray) -> None:
        self.box_lo, self.box_hi = box_lo, box_hi
        self.levels: list[list[np.ndarray]] = []
        self.leaves: list[np.ndarray] = []
        self.nodes = 0

    def add(self, order: np.ndarray, count: np.ndarray, starts: np.ndarray,
            inner: np.ndarray) -> None:
        """Append a level of nodes. For inner nodes, the caller must then call `split`."""
        n = len(count)
        first, second = np.full(n, -1, np.int64), np.full(n, -1, np.int64)
        first[inner] = self.nodes + n + np.arange(len(inner))
        second[inner] = first[inner] + len(inner)
        leaf = np.ones(n, bool)
        leaf[inner] = False
        self.leaves.append(order[expand(starts[leaf], count[leaf])])
        self.levels.append([first, second, np.where(leaf, count, 0), np.full(n, LEAF, np.int8),
                            np.zeros(n, np.float32), np.zeros(n, np.float32)])
        self.nodes += n

    def split(self, axis: np.ndarray, order: np.ndarray, starts: np.ndarray,
              left: np.ndarray) -> None:
        """Set axes and planes of the last level's inner nodes; `left` marks triangles of left
        children."""
        first, _, _, axes, left_hi, right_lo = self.levels[-1]
        inner = np.flatnonzero(first >= 0)
        along = axis[np.repeat(np.arange(len(starts)), np.diff(starts, append=len(order)))]
        hi, lo = self.box_hi[along, order], self.box_lo[along, order]
        axes[inner] = axis
        left_hi[inner] = np.maximum.reduceat(np.where(left, hi, -np.inf), starts)
        right_lo[inner] = np.minimum.reduceat(np.where(left, np.inf, lo), starts)

    def finish(self, depth: int) -> Bih:
        """Return the tree, with pairs of siblings in depth-first order."""
        if not self.nodes:
            zero, none = np.zeros(3, np.float32), np.zeros(0, np.int32)
            return Bih(zero, zero, np.zeros(0, np.int8), *2 * (np.zeros(0, np.float32),),
                       none, none, none, 0)
        first, second, count, axis, left_hi, right_lo = map(np.concatenate, zip(*self.levels))
        inner = tree_order.inner_levels(first, second)
        size = tree_order.subtree_sizes(inner, first, second)
        place = tree_order.depth_first_pairs(inner, size, first, second)
        source = np.argsort(place)
        start, count = run_starts(count)[source], count[source]
        order = np.concatenate(self.leaves)[expand(start, count)]
        first = first[source]
        child = np.where(first >= 0, place[first], run_starts(count))
        return Bih(self.box_lo.min(axis=1), self.box_hi.max(axis=1), axis[source],
                   left_hi[source], right_lo[source], child.astype(np.int32),
                   count.astype(np.int32), order.astype(np.int32), depth)
