"""Sound: whether a structure that was read from a file could have been built.

A checksum says that a file is whole, not who wrote it. What programs follow, indices above all, is
therefore checked: types, lengths, ranges, and that each node has one parent, so that every walk
ends.
"""
from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from . import tree_order
from .bih import Bih
from .bvh import Bvh
from .grid import Grid
from .kdtree import LEAF, KdTree
from .octree import Octree
from .visibility_field import AXES, VisibilityField


def is_sound(structure: Any, triangles: int) -> bool:
    """Whether the indices of a structure of so many triangles are in range, and its arrays as long
    as each other; always true of a class that is not this package's own."""
    check = _CHECKS.get(type(structure))
    return check is None or check(structure, triangles)


def _like(arrays: Mapping[str, np.ndarray], kind: str, *shape: int) -> bool:
    """Whether all are arrays of a kind of numbers and a shape, and finite where they are real."""
    return all(isinstance(a, np.ndarray) and a.dtype.kind == kind and a.shape == shape
               and (kind != "f" or bool(np.isfinite(a).all())) for a in arrays.values())


def _of(structure: Any, names: str) -> dict[str, np.ndarray]:
    return {name: getattr(structure, name) for name in names.split()}


def _within(values: np.ndarray, end: int, least: int = 0) -> bool:
    """Whether whole numbers lie in [least, end)."""
    return values.dtype.kind == "i" and values.ndim == 1 and (
        not len(values) or bool(least <= values.min() and values.max() < end))


def _runs(start: np.ndarray, entries: int, count: int) -> bool:
    """Whether starts, one more than there are runs, cut so many entries."""
    return (_within(start, entries + 1) and len(start) == count + 1 and start[0] == 0
            and start[-1] == entries and bool((np.diff(start) >= 0).all()))


def _leaves(first: np.ndarray, count: np.ndarray, entries: int) -> bool:
    """Whether the runs of leaves cut so many entries."""
    return _within(first, entries + 1) and _within(count, entries + 1) and bool(
        (first.astype(np.int64) + count <= entries).all() and count.sum() == entries)


def _is_tree(left: np.ndarray, right: np.ndarray, depth: Any) -> bool:
    """Whether nodes with these children, -1 for a leaf, are one tree of this depth."""
    nodes, inner = np.arange(len(left)), left >= 0
    if not isinstance(depth, int):
        return False
    for child in (left, right):
        if not (_within(child, len(nodes), -1) and (child[inner] > nodes[inner]).all()
                and (child[~inner] == -1).all()):
            return False
    children = np.concatenate([left[inner], right[inner]])
    parents = np.bincount(children, minlength=len(nodes))
    return bool(parents[0] == 0 and (parents[1:] == 1).all()
                and len(tree_order.levels(left, right)) - 1 == depth)


def _bvh(bvh: Bvh, triangles: int) -> bool:
    n = len(bvh.escape)
    if not (_like(_of(bvh, "lo hi"), "f", n, 3) and _like(_of(bvh, "escape first count"), "i", n)
            and _each_once(bvh.order, triangles) and _leaves(bvh.first, bvh.count, triangles)
            and _within(bvh.escape, n + 1)):
        return False
    if not n:
        return triangles == 0
    inner = np.flatnonzero(bvh.count == 0)
    if len(inner) and inner[-1] + 1 >= n or (bvh.escape <= np.arange(n)).any():
        return False
    if len(inner) and bvh.escape[inner + 1].max() >= n:
        return False
    left, right = bvh.children()
    return (_is_tree(left, right, bvh.depth) and bvh.escape[0] == n and bool(
        (bvh.escape[right[inner]] == bvh.escape[inner]).all()))


def _each_once(order: np.ndarray, triangles: int) -> bool:
    return _within(order, triangles) and len(order) == triangles and bool(
        (np.bincount(order, minlength=triangles) == 1).all())


def _pairs(axis: np.ndarray, child: np.ndarray, count: np.ndarray, entries: int, depth: Any
           ) -> bool:
    """Whether siblings are neighbours of one tree, and its leaves hold entries."""
    inner = axis != LEAF
    if not (_within(axis, LEAF + 1) and bool((count[inner] == 0).all())
            and _leaves(child[~inner], count[~inner], entries)):
        return False
    left = np.where(inner, child, -1).astype(np.int64)
    return _is_tree(left, np.where(inner, left + 1, -1), depth)


def _kdtree(tree: KdTree, triangles: int) -> bool:
    n = len(tree.axis)
    return (n > 0 and _like(_of(tree, "lo hi"), "f", 3) and _like(_of(tree, "split"), "f", n)
            and _like(_of(tree, "axis left count"), "i", n)
            and _within(tree.references, triangles)
            and _pairs(tree.axis, tree.left, tree.count, len(tree.references), tree.depth))


def _bih(tree: Bih, triangles: int) -> bool:
    n = len(tree.axis)
    return (_like(_of(tree, "lo hi"), "f", 3) and _like(_of(tree, "left_hi right_lo"), "f", n)
            and _like(_of(tree, "axis child count"), "i", n)
            and _each_once(tree.order, triangles)
            and (_pairs(tree.axis, tree.child, tree.count, triangles, tree.depth) if n
                 else triangles == 0))


def _grid(grid: Grid, triangles: int) -> bool:
    return (_like(_of(grid, "lo hi cell_size"), "f", 3) and _within(grid.resolution, 1 << 10, 1)
            and len(grid.resolution) == 3 and _within(grid.references, triangles)
            and _runs(grid.cell_start, len(grid.references),
                      int(np.prod(grid.resolution, dtype=np.int64))))


def _octree(tree: Octree, triangles: int) -> bool:
    cells, nodes = len(tree.span), np.arange(len(tree.child))
    if not _within(tree.child, len(nodes), -cells):
        return False
    inner = tree.child >= 0
    eight, leaf = tree.child[inner].astype(np.int64), -1 - tree.child[~inner].astype(np.int64)
    # Each node but the root is among the eight of one node, and each cell is one leaf.
    return (len(nodes) == 1 + 8 * len(eight) and bool((eight > nodes[inner]).all())
            and np.array_equal(np.sort(eight), 1 + 8 * np.arange(len(eight)))
            and np.array_equal(np.sort(leaf), np.arange(cells))
            and _like(_of(tree, "lo hi cell_size"), "f", 3)
            and len(tree.resolution) == 3 and _within(tree.resolution, 1 << 24, 1)
            and len(set(tree.resolution.tolist())) == 1
            and _like(_of(tree, "corner"), "i", cells, 3) and _like(_of(tree, "span"), "i", cells)
            and bool((tree.corner >= 0).all() and (tree.span >= 1).all()
                     and (tree.corner + tree.span[:, None] <= tree.resolution.max()).all())
            and _within(tree.references, triangles)
            and _runs(tree.cell_start, len(tree.references), cells))


def _field(field: VisibilityField, triangles: int) -> bool:
    m = len(field.triangle)
    if not (isinstance(field.directions, int) and isinstance(field.tiles, int)):
        return False
    beams = AXES * field.directions ** 2 * field.tiles ** 2 + AXES
    return (field.directions > 0 and field.tiles > 0
            and _like(_of(field, "near far reach"), "f", m)
            and _within(field.triangle, triangles) and _runs(field.beam_start, m, beams)
            and bool((field.near <= field.far).all() and (field.far <= field.reach).all()))


_CHECKS: Mapping[type, Callable[[Any, int], bool]] = {
    Bvh: _bvh, KdTree: _kdtree, Bih: _bih, Grid: _grid, Octree: _octree, VisibilityField: _field}
