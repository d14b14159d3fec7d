"""Sound: whether a structure that was read from a file could have been built.

A checksum says that a file is whole, not who wrote it. What programs follow, indices above all, is
therefore checked: types, lengths, ranges, and that each node has one parent, so that every walk
ends.
"""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from . import tree_order

LEAF = 3     # the axis of a leaf, in every tree whose siblings are neighbours


def is_sound(structure: Any, triangles: int) -> bool:
    """Whether ``structure`` could have been built over so many triangles, by its own ``is_sound``;
    always true of a class without that method."""
    check = getattr(structure, "is_sound", None)
    return check is None or check(triangles)


def alike(arrays: Mapping[str, np.ndarray], kind: str, *shape: int) -> bool:
    """Whether all are arrays of a kind of numbers and a shape, and finite where they are real."""
    return all(isinstance(a, np.ndarray) and a.dtype.kind == kind and a.shape == shape
               and (kind != "f" or bool(np.isfinite(a).all())) for a in arrays.values())


def named(structure: Any, names: str) -> dict[str, np.ndarray]:
    """The attributes that ``names`` lists, by name."""
    return {name: getattr(structure, name) for name in names.split()}


def within(values: np.ndarray, end: int, least: int = 0) -> bool:
    """Whether whole numbers lie in [least, end)."""
    return values.dtype.kind == "i" and values.ndim == 1 and (
        not len(values) or bool(least <= values.min() and values.max() < end))


def are_runs(start: np.ndarray, entries: int, count: int) -> bool:
    """Whether starts, one more than there are runs, cut so many entries."""
    return (within(start, entries + 1) and len(start) == count + 1 and start[0] == 0
            and start[-1] == entries and bool((np.diff(start) >= 0).all()))


def are_leaves(first: np.ndarray, count: np.ndarray, entries: int) -> bool:
    """Whether the runs of leaves cut so many entries."""
    return within(first, entries + 1) and within(count, entries + 1) and bool(
        (first.astype(np.int64) + count <= entries).all() and count.sum() == entries)


def is_tree(left: np.ndarray, right: np.ndarray, depth: Any) -> bool:
    """Whether nodes with these children, -1 for a leaf, are one tree of this depth."""
    nodes, inner = np.arange(len(left)), left >= 0
    if not isinstance(depth, int):
        return False
    for child in (left, right):
        if not (within(child, len(nodes), -1) and (child[inner] > nodes[inner]).all()
                and (child[~inner] == -1).all()):
            return False
    children = np.concatenate([left[inner], right[inner]])
    parents = np.bincount(children, minlength=len(nodes))
    return bool(parents[0] == 0 and (parents[1:] == 1).all()
                and len(tree_order.levels(left, right)) - 1 == depth)


def each_once(order: np.ndarray, triangles: int) -> bool:
    """Whether ``order`` holds each of so many triangles once."""
    return within(order, triangles) and len(order) == triangles and bool(
        (np.bincount(order, minlength=triangles) == 1).all())


def are_pairs(axis: np.ndarray, child: np.ndarray, count: np.ndarray, entries: int, depth: Any
              ) -> bool:
    """Whether siblings are neighbours of one tree, and its leaves hold entries."""
    inner = axis != LEAF
    if not (within(axis, LEAF + 1) and bool((count[inner] == 0).all())
            and are_leaves(child[~inner], count[~inner], entries)):
        return False
    left = np.where(inner, child, -1).astype(np.int64)
    return is_tree(left, np.where(inner, left + 1, -1), depth)
