"""Octree: the structure and its build. A cell with many triangles is halved along all three axes.

A. S. Glassner, "Space subdivision for fast ray tracing", 1984. N. A. Carr, J. D. Hall, J. C. Hart,
"The ray engine", Graphics Hardware 2002, traverse an octree on the host. A cell lists the
triangles that overlap it, by the tests of `grid/cells.py`.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...accel.bounds import as_triangles, padding, scene_box
from ...accel.options import in_range, refuse_unknown
from ...accel.runs import chunks
from ...accel.sound import alike, are_runs, named, within
from ..grid.cells import FINEST_CELL, USUAL_REFERENCES, Shapes

MOST_LEVELS = 9         # 512 of the finest cells along each axis
CHUNK = 1 << 18         # pairs of triangle and cell that are tested together


@dataclass(frozen=True)
class Octree:
    """An octree over a cube. Its leaves are the cells, sorted by level.

    Positions of cells are in units of the finest cells, from the cube's lower corner.

    Attributes
    ----------
    lo, hi : (3,) float32, the padded scene box, world units; the cube begins at lo
    resolution : (3,) int32, the number of finest cells along each axis, 2^levels
    cell_size : (3,) float32, the size of the finest cells, world units
    child : (nodes,) int32, the first of a node's eight children (x varies fastest), or -1 - cell
        for a leaf
    corner : (cells, 3) int32, the lower corner of each cell
    span : (cells,) int32, the width of each cell in finest cells
    cell_start : (cells + 1,) int32, each cell's first reference; the last entry is m
    references : (m,) int32, triangles, ascending within a cell
    """

    lo: np.ndarray
    hi: np.ndarray
    resolution: np.ndarray
    cell_size: np.ndarray
    child: np.ndarray
    corner: np.ndarray
    span: np.ndarray
    cell_start: np.ndarray
    references: np.ndarray

    def is_sound(self, triangles: int) -> bool:
        """Whether the arrays are valid for ``triangles`` triangles; see ``accel/sound.py``."""
        cells, nodes = len(self.span), np.arange(len(self.child))
        if not within(self.child, len(nodes), -cells):
            return False
        inner = self.child >= 0
        eight, leaf = self.child[inner].astype(np.int64), -1 - self.child[~inner].astype(np.int64)
        # Each node except the root must have one parent, and each cell one leaf.
        return (len(nodes) == 1 + 8 * len(eight) and bool((eight > nodes[inner]).all())
                and np.array_equal(np.sort(eight), 1 + 8 * np.arange(len(eight)))
                and np.array_equal(np.sort(leaf), np.arange(cells))
                and alike(named(self, "lo hi cell_size"), "f", 3)
                and len(self.resolution) == 3 and within(self.resolution, 1 << 24, 1)
                and len(set(self.resolution.tolist())) == 1
                and alike(named(self, "corner"), "i", cells, 3)
                and alike(named(self, "span"), "i", cells)
                and bool((self.corner >= 0).all() and (self.span >= 1).all()
                         and (self.corner + self.span[:, None] <= self.resolution.max()).all())
                and within(self.references, triangles)
                and are_runs(self.cell_start, len(self.references), cells))


def build_octree(triangles: np.ndarray, *, leaf_size: int = 8, density: float = 2.0,
                 **unknown: object) -> Octree:
    """Build an octree.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units
    leaf_size : cells that hold more triangles are split
    density : limits the depth: a full tree of this depth has 8 to 64 times `density` cells per
        triangle. MOST_LEVELS and FINEST_CELL may lower the limit. The build also ends if another
        level could lead to more than about 64 references per triangle

    Raises
    ------
    OptionError, SceneError
    """
    refuse_unknown(build_octree, unknown)
    leaf_size = in_range("leaf_size", leaf_size, 1, 1 << 24, int)
    density = in_range("density", density, 1e-9, 1e9)
    triangles = as_triangles(triangles)
    lo, hi = scene_box(triangles)
    edge = float((hi.astype(np.float64) - lo).max())
    levels = _levels(len(triangles), edge / (FINEST_CELL * float(padding(triangles))), density)
    # The pairs of the current level: a triangle, and a node that it overlaps.
    triangle, node = np.arange(len(triangles)), np.zeros(len(triangles), np.int64)
    place, first, child, leaves = np.zeros((1, 3), np.int64), 0, [], []
    cells, kept = 0, 0
    for level in range(levels + 1):
        count = np.bincount(node, minlength=len(place))
        split = count > leaf_size
        if level == levels or kept + 8 * count[split].sum() > USUAL_REFERENCES * (
                len(triangles) + 64):
            split[:] = False
        # The children are stored after this level's nodes, in the order of their parents.
        inner, leaf = np.cumsum(split) - 1, np.cumsum(~split) - 1
        child.append(np.where(split, first + len(place) + 8 * inner, -1 - cells - leaf))
        span = 1 << (levels - level)
        ends = ~split[node]
        leaves.append((place[~split] * span, np.full((~split).sum(), span),
                       (cells + leaf[node[ends]]) << 32 | triangle[ends]))
        cells, kept = cells + int((~split).sum()), kept + int(ends.sum())
        first += len(place)
        if not split.any():
            break
        shapes = Shapes(triangles, lo, lo + edge, np.full(3, 2 << level))
        offsets = np.stack([np.arange(8) & 1, np.arange(8) >> 1 & 1, np.arange(8) >> 2], 1)
        triangle, node = _handed_down(shapes, triangle[~ends], inner[node[~ends]],
                                      2 * place[split], offsets)
        place = (2 * place[split][:, None] + offsets).reshape(-1, 3)
    corner, spans, keys = (np.concatenate(parts) for parts in zip(*leaves))
    keys.sort()
    return Octree(
        lo, hi, np.full(3, 1 << levels, np.int32),
        np.full(3, edge / (1 << levels), np.float32), np.concatenate(child).astype(np.int32),
        corner.astype(np.int32), spans.astype(np.int32),
        np.searchsorted(keys >> 32, np.arange(cells + 1)).astype(np.int32),
        (keys & 0xffffffff).astype(np.int32))


def _levels(triangles: int, finest: float, density: float) -> int:
    """Return the number of levels below the root. An axis never gets more than `finest` cells."""
    wanted = np.ceil(np.log2(max(8 * density * triangles, 1)) / 3)
    return int(np.clip(min(wanted, np.floor(np.log2(max(finest, 1)))), 0, MOST_LEVELS))


def _handed_down(shapes: Shapes, triangle: np.ndarray, parent: np.ndarray, corner: np.ndarray,
                 offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the overlapping pairs of triangle and child, given pairs of triangle and parent.

    Parameters
    ----------
    triangle, parent : (k,) int64
    corner : (parents, 3) int64, the position of each parent's first child
    offsets : (8, 3) int64, the positions of the eight children relative to the first child
    """
    triangles, nodes = [triangle[:0]], [parent[:0]]
    for part in chunks(np.full(len(triangle), 8), CHUNK):
        # Along each axis, find the halves of the parent that the triangle's box overlaps.
        begin = shapes.first[triangle[part]] - corner[parent[part]]
        end = begin + shapes.cell_count[triangle[part]]
        along = np.stack([(begin <= 0) & (end > 0), (begin <= 1) & (end > 1)])
        boxes = np.logical_and.reduce([along[offsets[:, a], :, a] for a in range(3)])
        which, pair = np.nonzero(boxes)
        who, above = triangle[part][pair], parent[part][pair]
        kept = np.flatnonzero(shapes.overlap(who, corner[above] + offsets[which]))
        triangles.append(who[kept])
        nodes.append(8 * above[kept] + which[kept])
    return np.concatenate(triangles), np.concatenate(nodes)
