"""Image tree: builds quadtrees over a geometry image's cells, with links (Carr et al. 2006).

A chart is a rectangle of texels, which hold positions. A cell is a quad between 2 x 2 neighbouring
texels. The tree depends only on the sizes of the charts and on the level of detail; passes compute
the boxes (pyramid.py).

A mesh that is no geometry image becomes an image of unconnected cells along a Morton curve, each
with a single triangle. A quadtree over the curve is then a hierarchy over space.
"""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...accel.bounds import triangle_boxes
from ...accel.image_cells import cell_faces
from ...accel.morton import morton_2d, morton_order
from ...accel.runs import run_starts
from ...errors import SceneError


@dataclass(frozen=True)
class ImageTree:
    """A forest with a quadtree for each chart, or one quadtree over single triangles.

    Nodes are stored level by level, the cells first.

    Attributes
    ----------
    charts : Rows and columns of texels of each chart. Empty for single triangles.
    faces : The texels of the corners of each of the scene's triangles, (n, 3) int64.
    texels : Number of texels.
    first, last : A node's first and last child, or a cell's first and last texel, (m,) int32.
    miss : The node after a node's subtree, (m,) int32; after a root, the next root or -1.
    hit : A node's first child, (m,) int32; -1 - i for quad i of `corner`, where rays stop.
    levels : The first node of each level, then the number of nodes, (k + 1,) int64.
    corner : The first texel of each quad at the level where rays stop, (leaves,) int32.
    across, down : Distance in texels, (leaves,) int32, from the first corner of each quad to the
        next corner in the same row, and in the same column.
    face : The first face of each quad in `corner`, (leaves,) int32.
    root : The root of the first quadtree, or -1 if there are no cells.
    """

    charts: tuple[tuple[int, int], ...]
    faces: np.ndarray
    texels: int
    first: np.ndarray
    last: np.ndarray
    miss: np.ndarray
    hit: np.ndarray
    levels: np.ndarray
    corner: np.ndarray
    across: np.ndarray
    down: np.ndarray
    face: np.ndarray
    root: int

    @property
    def roots(self) -> np.ndarray:
        """Return the root of each quadtree, (charts,) int64, or (1,) for single triangles."""
        found, node = [], self.root
        while node >= 0:
            found.append(node)
            node = int(self.miss[node])
        return np.array(found, np.int64)

    def positions(self, triangles: np.ndarray) -> np.ndarray:
        """Return the positions of all texels, (texels, 3) float32, from (n, 3, 3) triangles.

        A triangle without area provides only its first corner: `shrink_flat` moved the other two.

        Raises
        ------
        SceneError
            if two triangles have different positions for a shared corner
        """
        at = np.empty((self.texels, 3), np.float32)
        flat = self.without_area(triangles)
        if flat.any():
            at[self.faces[flat]] = triangles[flat]
            at[self.faces[:, 0]] = triangles[:, 0]
            faces, triangles = self.faces[~flat], triangles[~flat]
        else:
            faces = self.faces
        at[faces] = triangles
        if self.charts and not np.array_equal(at[faces], triangles):
            raise SceneError("the triangles are not the cells of the scene's charts; for a "
                             "changed mesh, leave charts out")
        return at

    def without_area(self, triangles: np.ndarray) -> np.ndarray:
        """Return whether each triangle has no area, (n,) bool. Call `shrink_flat` first."""
        v0, v1, v2 = triangles.transpose(1, 2, 0)    # faster one axis at a time
        return np.logical_and.reduce([v0[a] == v[a] for v in (v1, v2) for a in range(3)])

    def halves(self, positions: np.ndarray) -> np.ndarray:
        """Return both triangles of each quad at the level where rays stop, (leaves, 2, 3, 3)."""
        a, d = positions[self.corner], positions[self.corner + self.down]
        b = positions[self.corner + self.across]
        c = positions[self.corner + self.across + self.down]
        return np.stack([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)], axis=1)


@dataclass(frozen=True)
class _Cells:
    """The cells of a chart, in the order of the Morton curve of its quadtree.

    Attributes
    ----------
    code : (c,) int64, ascending Morton codes, two bits per level
    corner : (c,), the first texel of each cell
    width : the distance in texels between rows
    face : (c,), the first face of each cell
    rows_left, columns_left : (c,), the numbers of rows and of columns from each cell, inclusive,
        to the chart's end
    """

    code: np.ndarray
    corner: np.ndarray
    width: int
    face: np.ndarray
    rows_left: np.ndarray
    columns_left: np.ndarray


def build_image_tree(charts: Sequence[tuple[int, int]], level: int = 0) -> ImageTree:
    """Build the quadtrees of charts with these (rows, columns) of texels.

    Parameters
    ----------
    level : level of detail; rays stop at quads of 2^level x 2^level cells
    """
    cells, texel, face = [], 0, 0
    for rows, columns in charts:
        r, c = (axis.reshape(-1) for axis in np.indices((rows - 1, columns - 1)))
        corner = texel + r * columns + c
        code = morton_2d(r, c)
        order = np.argsort(code)
        cells.append(_Cells(code[order], corner[order], columns,
                            face + 2 * order, rows - 1 - r[order], columns - 1 - c[order]))
        texel, face = texel + rows * columns, face + 2 * len(order)
    return _forest(tuple(charts), cells, cell_faces(charts), texel, level)


def build_triangle_image(triangles: np.ndarray) -> ImageTree:
    """Build the quadtree over (n, 3, 3) triangles along a Morton curve.

    A cell has three texels, the corners of the quad v0 v1 v2 v1. Both halves of this quad are the
    same triangle, so programs test only the first half.
    """
    lo, hi = triangle_boxes(triangles)
    order = morton_order((lo * np.float32(0.5) + hi * np.float32(0.5)).T)
    count, one = len(order), np.ones(len(order), np.int64)
    faces = np.empty((count, 3), np.int64)
    faces[order] = np.arange(3 * count).reshape(-1, 3)
    cells = _Cells(np.arange(count), 3 * np.arange(count), 1, order, one, one)
    return _forest((), [cells] if count else [], faces, 3 * count, 0)


def _forest(charts: tuple[tuple[int, int], ...], cells: list[_Cells], faces: np.ndarray,
            texels: int, stop: int) -> ImageTree:
    trees = [_tree(chart.code) for chart in cells]
    heights = max((len(tree) for tree in trees), default=0)
    counts = np.array([[len(tree[h]) if h < len(tree) else 0 for tree in trees]
                       for h in range(heights)], np.int64).reshape(heights, len(trees))
    starts = run_starts(counts.reshape(-1)).reshape(counts.shape)
    nodes = int(counts.sum())
    first, last, miss, hit = (np.full(nodes, -1, np.int32) for _ in range(4))
    leaves: dict[str, list[np.ndarray]] = {name: [] for name in (
        "corner", "across", "down", "face")}
    leaf = 0
    for k, (chart, tree) in enumerate(zip(cells, trees)):
        top = len(tree) - 1
        bottom = min(stop, top)
        after = -1 if k + 1 == len(trees) else int(starts[len(trees[k + 1]) - 1, k + 1])
        here = slice(starts[0, k], starts[0, k] + len(chart.code))
        first[here], last[here] = chart.corner, chart.corner + chart.width + 1
        miss[starts[top, k]] = after
        for h in range(top, 0, -1):
            begin, below = starts[h, k], starts[h - 1, k]
            inner = slice(begin, begin + len(tree[h]))
            children = np.append(tree[h], len(tree[h - 1])) + below
            first[inner], last[inner] = children[:-1], children[1:] - 1
            hit[inner] = first[inner]
            lower = slice(below, below + len(tree[h - 1]))
            miss[lower] = np.arange(below + 1, lower.stop + 1)
            miss[last[inner]] = miss[inner]
        source = np.arange(len(chart.code))
        for h in range(1, bottom + 1):     # find the first cell of each quad
            source = source[tree[h]]
        quads = slice(starts[bottom, k], starts[bottom, k] + len(source))
        hit[quads] = -1 - leaf - np.arange(len(source))
        leaf += len(source)
        side = 1 << bottom
        leaves["corner"].append(chart.corner[source])
        leaves["face"].append(chart.face[source])
        leaves["across"].append(np.minimum(chart.columns_left[source], side))
        leaves["down"].append(np.minimum(chart.rows_left[source], side) * chart.width)
    found = {name: np.concatenate([np.zeros(0, np.int64), *parts]).astype(np.int32)
             for name, parts in leaves.items()}
    levels = np.append(starts[:, 0] if trees else np.zeros(0, np.int64), nodes)
    root = int(starts[len(trees[0]) - 1, 0]) if trees else -1
    return ImageTree(charts, faces, texels, first, last, miss, hit, levels, root=root, **found)


def _tree(code: np.ndarray) -> list[np.ndarray]:
    """Return the first child of every node, level by level, from the cells up to one root.

    Children are numbered within their own level. For a cell, the "child" is the cell itself.
    """
    tree = [np.arange(len(code))]
    while len(code) > 1:
        parents, children = np.unique(code >> 2, return_index=True)
        tree.append(children)
        code = parents
    return tree
