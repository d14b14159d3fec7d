"""Image tree: the quadtrees over a geometry image's cells, threaded (Carr et al. 2006).

The tree depends on the charts' sizes alone: positions may change as they like, only boxes follow.
Those are not here: fragment passes compute them (gpgpu_rt/methods/geometry_image/pyramid.py).

A mesh that is no geometry image is made one of unconnected cells, a triangle each, along a Morton
curve; the quadtree over the curve is then the one over space.
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
    """A forest of quadtrees, a chart each; nodes level by level, the cells first.

    charts : (rows, columns) of texels of each; empty for single triangles
    faces : (n, 3) int64, the texels of each of the scene's triangles
    texels : int
    first, last : (m,) int32, a node's first and last child; of a cell its first and last texel
    miss : (m,) int32, the node after its subtree, -1 at the end; roots lead to the next root
    hit : (m,) int32, its first child, or -1 minus its leaf
    levels : (k + 1,) int64, where the nodes of each level begin, and how many there are
    corner, across, down, face : (leaves,) int32, the quads at the level where rays stop: texel,
        texels from there to the next corner in its row and to the one in its column, first face
    root : int, the first chart's, or -1
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
        """(charts,) int64, or (1,) of single triangles: where each quadtree begins."""
        found, node = [], self.root
        while node >= 0:
            found.append(node)
            node = int(self.miss[node])
        return np.array(found, np.int64)

    def positions(self, triangles: np.ndarray) -> np.ndarray:
        """(texels, 3) float32 from the (n, 3, 3) triangles; those without area only have their
        first corner (see `shrink_flat`).

        Raises
        ------
        SceneError
            where two triangles disagree about the corner they share
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
            raise SceneError("the triangles are not the cells of the scene's charts; leave charts "
                             "out for a mesh that was changed")
        return at

    def without_area(self, triangles: np.ndarray) -> np.ndarray:
        """(n,) bool, of triangles that went through `shrink_flat`."""
        v0, v1, v2 = triangles.transpose(1, 2, 0)    # an axis at a time is a good deal faster
        return np.logical_and.reduce([v0[a] == v[a] for v in (v1, v2) for a in range(3)])

    def halves(self, positions: np.ndarray) -> np.ndarray:
        """(leaves, 2, 3, 3): both triangles of each quad where rays stop."""
        a, d = positions[self.corner], positions[self.corner + self.down]
        b = positions[self.corner + self.across]
        c = positions[self.corner + self.across + self.down]
        return np.stack([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)], axis=1)


@dataclass(frozen=True)
class _Cells:
    """A chart's cells along the curve that its quadtree follows.

    code : (c,) int64, ascending: two bits a level
    corner, width : first texel of each, and texels from there to the one below
    face : (c,) its first face
    rows_left, columns_left : (c,) cells from there to the chart's end, itself included
    """

    code: np.ndarray
    corner: np.ndarray
    width: int
    face: np.ndarray
    rows_left: np.ndarray
    columns_left: np.ndarray


def build_image_tree(charts: Sequence[tuple[int, int]], level: int = 0) -> ImageTree:
    """The quadtrees of charts with these (rows, columns) of texels.

    Parameters
    ----------
    level : where rays stop: at quads of 2^level x 2^level cells
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
    """The quadtree over (n, 3, 3) triangles, each a cell, along a Morton curve.

    Three texels in a row, a cell's second one being its far corner and the one beside it at once:
    of the quad v0 v1 v2 v1 the second triangle has no area.
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
    # level by level, chart by chart
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
        for h in range(1, bottom + 1):     # the first cell of each quad
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
    """For each level from the cells up to one node: the first child of every node, counted within
    the level below (the cells' own entry is their number)."""
    tree = [np.arange(len(code))]
    while len(code) > 1:
        parents, children = np.unique(code >> 2, return_index=True)
        tree.append(children)
        code = parents
    return tree
