"""Tree order: levels, subtree sizes and depth-first positions of a binary tree stored in arrays.

`left` and `right` contain the children of each node, or -1 for a leaf. Node 0 is the root.
"""
from __future__ import annotations

import numpy as np


def levels(left: np.ndarray, right: np.ndarray) -> list[np.ndarray]:
    """Return the nodes of each depth, from the root down."""
    result = [np.zeros(1, np.int64)]
    while True:
        inner = result[-1][left[result[-1]] >= 0]
        if not len(inner):
            return result
        result.append(np.concatenate([left[inner], right[inner]]))


def pair_parents(left: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Return (n,) int32, the parent of each node, -1 for the root. ``inner``, (n,) bool, marks
    inner nodes. The caller ensures that each right child directly follows its left sibling."""
    parent = np.full(len(left), -1, np.int32)
    nodes = np.flatnonzero(inner)
    parent[left[nodes]] = parent[left[nodes] + 1] = nodes
    return parent


def inner_levels(left: np.ndarray, right: np.ndarray) -> list[np.ndarray]:
    """Return the inner nodes of each depth, from the root to the deepest inner node."""
    return [nodes[left[nodes] >= 0] for nodes in levels(left, right)][:-1]


def subtree_sizes(inner: list[np.ndarray], left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return (n,) int64, the number of nodes in each node's subtree, including the node."""
    size = np.ones(len(left), np.int64)
    for nodes in reversed(inner):
        size[nodes] += size[left[nodes]] + size[right[nodes]]
    return size


def depth_first(inner: list[np.ndarray], size: np.ndarray, first: np.ndarray,
                second: np.ndarray) -> np.ndarray:
    """Return the depth-first position of each node, (..., n) int64.

    A node comes first, then the subtrees of its `first` and of its `second` child.

    Parameters
    ----------
    first, second : (..., n) int, the children of each node in the required order. Leading axes
        allow several orders of the same tree.
    """
    place = np.zeros(first.shape, np.int64)
    for nodes in inner:
        one, two = first[..., nodes], second[..., nodes]
        here = place[..., nodes]
        np.put_along_axis(place, one, here + 1, axis=-1)
        np.put_along_axis(place, two, here + 1 + size[one], axis=-1)
    return place


def depth_first_pairs(inner: list[np.ndarray], size: np.ndarray, left: np.ndarray,
                      right: np.ndarray) -> np.ndarray:
    """Return the position of each node in an order that keeps siblings together: a pair of
    siblings, then all nodes below the left sibling, then all nodes below the right sibling. The
    root is at position 0."""
    place = np.zeros(len(left), np.int64)
    below = np.ones(len(left), np.int64)     # position of each node's pair of children
    for nodes in inner:
        one, two, pair = left[nodes], right[nodes], below[nodes]
        place[one], place[two] = pair, pair + 1
        below[one] = pair + 2
        below[two] = pair + 1 + size[one]
    return place


def kept_nodes(inner: list[np.ndarray], left: np.ndarray, right: np.ndarray, count: np.ndarray,
               most: int) -> np.ndarray:
    """Return (n,) bool, the nodes to keep so that at most ``most`` nodes remain. The subtrees with
    the fewest entries (triangles) become leaves.

    Parameters
    ----------
    inner : the inner nodes by level, from `inner_levels`
    count : (n,) int, the number of entries of each leaf
    """
    held = count.copy()
    for nodes in reversed(inner):
        held[nodes] = held[left[nodes]] + held[right[nodes]]
    above = np.full(len(held), np.iinfo(np.int64).max)     # number of entries below the parent
    for nodes in inner:
        above[left[nodes]] = above[right[nodes]] = held[nodes]
    kept = np.ones(len(held), bool)
    if len(held) > most:
        at = len(above) - most - 1
        # Drop the children of the nodes with the fewest entries.
        kept = above > np.partition(above, at)[at]
    return kept


def cut(inner: list[np.ndarray], left: np.ndarray, right: np.ndarray,
        kept: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the tree of the kept nodes, in their old order.

    Parameters
    ----------
    kept : (n,) bool. Both children of a node are kept, or neither is. The ancestors of a kept node
        are kept

    Returns
    -------
    inside : (n,) bool, whether a node remains an inner node
    left, right : (k,) int, the children of the k kept nodes
    place : (n,) int64, the new position of each node; for a dropped node, the position of its
        nearest kept ancestor
    """
    place = np.cumsum(kept) - 1
    inside = kept & (left >= 0)
    inside[inside] = kept[left[inside]]
    below = tuple(np.where(inside, place[child], -1)[kept] for child in (left, right))
    for nodes in inner:
        for child in (left[nodes], right[nodes]):
            place[child] = np.where(kept[child], place[child], place[nodes])
    return inside, *below, place
