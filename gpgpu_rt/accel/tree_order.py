"""Tree order: levels, subtree sizes and depth-first positions of a binary tree of arrays.

`left` and `right` hold each node's children, -1 for a leaf; node 0 is the root.
"""
from __future__ import annotations

import numpy as np


def levels(left: np.ndarray, right: np.ndarray) -> list[np.ndarray]:
    """The nodes of each depth, the root's first."""
    result = [np.zeros(1, np.int64)]
    while True:
        inner = result[-1][left[result[-1]] >= 0]
        if not len(inner):
            return result
        result.append(np.concatenate([left[inner], right[inner]]))


def pair_parents(left: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """(n,) int32, each node's parent, -1 for the root, where the right child of an inner node
    follows the left one; ``inner``: (n,) bool."""
    parent = np.full(len(left), -1, np.int32)
    nodes = np.flatnonzero(inner)
    parent[left[nodes]] = parent[left[nodes] + 1] = nodes
    return parent


def inner_levels(left: np.ndarray, right: np.ndarray) -> list[np.ndarray]:
    """The inner nodes of each depth that has any, the root's first."""
    return [nodes[left[nodes] >= 0] for nodes in levels(left, right)][:-1]


def subtree_sizes(inner: list[np.ndarray], left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Nodes in each node's subtree, itself included: (n,) int64."""
    size = np.ones(len(left), np.int64)
    for nodes in reversed(inner):
        size[nodes] += size[left[nodes]] + size[right[nodes]]
    return size


def depth_first(inner: list[np.ndarray], size: np.ndarray, first: np.ndarray,
                second: np.ndarray) -> np.ndarray:
    """Each node's place when node, subtree of `first`, subtree of `second` follow one another.

    first, second : (..., n) int, the children in the order wanted; leading axes are copies.
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
    """Each node's place when siblings stay together: a pair, then the subtree below its
    left one, then the subtree below its right one. The root is at 0."""
    place = np.zeros(len(left), np.int64)
    below = np.ones(len(left), np.int64)     # where the pair of a node's children goes
    for nodes in inner:
        one, two, pair = left[nodes], right[nodes], below[nodes]
        place[one], place[two] = pair, pair + 1
        below[one] = pair + 2
        below[two] = pair + 1 + size[one]
    return place


def kept_nodes(inner: list[np.ndarray], left: np.ndarray, right: np.ndarray, count: np.ndarray,
               most: int) -> np.ndarray:
    """(n,) bool: the nodes of a tree of at most so many, its smallest subtrees made leaves.

    Parameters
    ----------
    inner : as `inner_levels` returns them
    count : (n,) int, what a leaf holds
    """
    held = count.copy()
    for nodes in reversed(inner):
        held[nodes] = held[left[nodes]] + held[right[nodes]]
    above = np.full(len(held), np.iinfo(np.int64).max)     # what the parent holds
    for nodes in inner:
        above[left[nodes]] = above[right[nodes]] = held[nodes]
    kept = np.ones(len(held), bool)
    if len(held) > most:
        at = len(above) - most - 1
        kept = above > np.partition(above, at)[at]         # of the largest that becomes a leaf
    return kept


def cut(inner: list[np.ndarray], left: np.ndarray, right: np.ndarray,
        kept: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The tree of the nodes kept, in the same order; above a node kept all are.

    Parameters
    ----------
    kept : (n,) bool, both children of a node or neither

    Returns
    -------
    (inside, left, right, place)
        (n,) bool, inner nodes that stay so; (k,) int, children of the k nodes kept; (n,) int64,
        which of these a node is or lies in
    """
    place = np.cumsum(kept) - 1
    inside = kept & (left >= 0)
    inside[inside] = kept[left[inside]]
    below = tuple(np.where(inside, place[child], -1)[kept] for child in (left, right))
    for nodes in inner:
        for child in (left[nodes], right[nodes]):
            place[child] = np.where(kept[child], place[child], place[nodes])
    return inside, *below, place
