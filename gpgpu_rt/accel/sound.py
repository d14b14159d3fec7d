"""Sound: checks whether a builder could have made a structure that was read from a file.

A checksum shows that a file is complete, but not who wrote it. With wrong indices, a shader could
read outside a table, or never end a loop. Therefore types, lengths and ranges are checked, and
each node except the root must have a single parent.
"""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from . import tree_order

LEAF = 3     # the axis of a leaf, in trees that store siblings side by side


def is_sound(structure: Any, triangles: int) -> bool:
    """Return whether a builder could have made the structure from ``triangles`` triangles. The
    structure's own method ``is_sound`` decides; without this method, return true."""
    check = getattr(structure, "is_sound", None)
    return check is None or check(triangles)


def alike(arrays: Mapping[str, np.ndarray], kind: str, *shape: int) -> bool:
    """Return whether all values are numpy arrays with this ``kind`` of dtype and this shape;
    floats must also be finite."""
    return all(isinstance(a, np.ndarray) and a.dtype.kind == kind and a.shape == shape
               and (kind != "f" or bool(np.isfinite(a).all())) for a in arrays.values())


def named(structure: Any, names: str) -> dict[str, np.ndarray]:
    """Return attributes of ``structure`` by name; ``names`` are separated by spaces."""
    return {name: getattr(structure, name) for name in names.split()}


def within(values: np.ndarray, end: int, least: int = 0) -> bool:
    """Return whether (n,) values are integers in [least, end)."""
    return values.dtype.kind == "i" and values.ndim == 1 and (
        not len(values) or bool(least <= values.min() and values.max() < end))


def are_runs(start: np.ndarray, entries: int, count: int) -> bool:
    """Return whether ``start`` holds the starts of ``count`` runs, then the end of the last run.
    The lengths of the runs must add up to ``entries``."""
    return (within(start, entries + 1) and len(start) == count + 1 and start[0] == 0
            and start[-1] == entries and bool((np.diff(start) >= 0).all()))


def are_leaves(first: np.ndarray, count: np.ndarray, entries: int) -> bool:
    """Return whether the runs of the leaves lie within ``entries`` entries, and their lengths add
    up to ``entries``."""
    return within(first, entries + 1) and within(count, entries + 1) and bool(
        (first.astype(np.int64) + count <= entries).all() and count.sum() == entries)


def is_tree(left: np.ndarray, right: np.ndarray, depth: Any) -> bool:
    """Return whether nodes with these children, -1 for a leaf, form a single tree of this
    depth. Each child must come after its parent."""
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
    """Return whether ``order`` contains each index from 0 to ``triangles`` - 1 exactly once."""
    return within(order, triangles) and len(order) == triangles and bool(
        (np.bincount(order, minlength=triangles) == 1).all())


def are_pairs(axis: np.ndarray, child: np.ndarray, count: np.ndarray, entries: int, depth: Any
              ) -> bool:
    """Return whether nodes form a single tree of this depth. Each child must come after its
    parent, and each right child directly after its left sibling. The leaves must contain
    ``entries`` entries in total."""
    inner = axis != LEAF
    nodes = np.flatnonzero(inner)
    left = child[nodes]
    if not (isinstance(depth, int) and within(axis, LEAF + 1) and not count[nodes].any()
            and are_leaves(child[~inner], count[~inner], entries)
            and within(left, len(axis) - 1, 1) and bool((left > nodes).all())):
        return False
    has_parent = np.zeros(len(axis), bool)
    has_parent[left] = has_parent[left + 1] = True
    if not (len(axis) == 2 * len(nodes) + 1 and has_parent[1:].all()):
        return False    # a node other than the root does not have exactly one parent
    children = np.where(inner, child, -1)
    return len(tree_order.levels(children, children + 1)) - 1 == depth
