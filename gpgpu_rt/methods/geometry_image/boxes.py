"""Image boxes: computes the boxes of an image tree, and front-to-back links, on the host.

Traversal uses only the links; fragment passes compute its boxes. When positions change, the links
stay valid, but may no longer lead from front to back.
"""
from __future__ import annotations

from itertools import pairwise

import numpy as np

from .tree import ImageTree


def image_boxes(tree: ImageTree, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and the upper corners of every node's box, (m, 3) float32 each.

    ``positions`` is (texels, 3).
    """
    lo, hi = (np.empty((len(tree.miss), 3), np.float32) for _ in range(2))
    for height, (begin, end) in enumerate(pairwise(tree.levels)):
        first, last = tree.first[begin:end], tree.last[begin:end]
        if height:
            parts = [np.minimum(first + k, last) for k in range(4)]
        else:
            parts = [first, first + 1, last - 1, last]
        below = (lo, hi) if height else (positions, positions)
        lo[begin:end] = np.minimum.reduce([below[0][part] for part in parts])
        hi[begin:end] = np.maximum.reduce([below[1][part] for part in parts])
    return lo, hi


def octant_links(tree: ImageTree, positions: np.ndarray
                 ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the links for the rays of each direction octant.

    Component a of a direction is negative if and only if bit a of its octant is set.

    Returns
    -------
    miss, hit : (8, m) int32, as in ImageTree, but siblings follow each other by the depth of their
        centres along the octant's diagonal
    roots : (8,) int32, the first root for each octant
    """
    lo, hi = image_boxes(tree, positions)
    signs = 1 - 2 * (np.arange(8)[:, None] >> np.arange(3) & 1)
    depth = signs @ (lo.astype(np.float64) + hi).T
    miss, hit = np.empty((2, 8, len(tree.miss)), np.int32)
    hit[:] = tree.hit
    parent = np.full(len(tree.miss), -1)
    for begin, end in pairwise(tree.levels[1:]):
        spread = np.arange(begin, end)
        count = tree.last[begin:end] - tree.first[begin:end] + 1
        children = np.repeat(tree.first[begin:end] - np.cumsum(count) + count, count)
        parent[children + np.arange(len(children))] = np.repeat(spread, count)
    roots = np.flatnonzero(parent < 0)
    entry = np.full(8, -1, np.int32)
    for octant in range(8):
        if len(roots):
            ordered = roots[np.argsort(depth[octant, roots], kind="stable")]
            miss[octant, ordered] = np.append(ordered[1:], -1)
            entry[octant] = ordered[0]
        for begin, end in reversed(list(pairwise(tree.levels))[:-1]):
            nodes = np.arange(begin, end)
            nodes = nodes[parent[begin:end] >= 0]
            ordered = nodes[np.lexsort((depth[octant, nodes], parent[nodes]))]
            above = parent[ordered]
            ends = np.append(above[1:] != above[:-1], True)
            miss[octant, ordered] = np.where(ends, miss[octant, above], np.append(ordered[1:], -1))
            first = np.append(True, ends[:-1])[:len(ordered)]
            inner = tree.hit[above[first]] >= 0
            hit[octant, above[first][inner]] = ordered[first][inner]
    return miss, hit, entry
