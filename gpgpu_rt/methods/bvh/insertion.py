"""Insertion build: adds triangles to the tree one after another.

J. Goldsmith, J. Salmon, "Automatic creation of object hierarchies for ray tracing", IEEE CG&A
7(5), 1987. The tree is binary with one triangle per leaf, as in Thrane and Simonsen (2005). A
triangle descends from the root, always into the child whose area grows least. One node of this
path then becomes its sibling, under a new parent. The build picks the node that adds the least
area: the new parent's area plus the growth of its ancestors. The result depends on the order of
insertion, so the triangles are shuffled.
"""
from __future__ import annotations

import numpy as np

from ...accel.bounds import triangle_boxes
from ...accel.options import in_range, refuse_unknown
from .tree import LooseTree


def build(triangles: np.ndarray, *, seed: int = 0, **unknown: object) -> LooseTree:
    """Build a tree with one triangle per leaf; `seed` determines the order of insertion."""
    refuse_unknown(build, unknown)
    seed = in_range("seed", seed, 0, 2**32 - 1, int)
    n = len(triangles)
    if n == 0:
        empty = np.zeros(0, np.int64)
        return LooseTree(empty, empty, empty, empty)
    order = np.random.default_rng(seed).permutation(n)
    box = np.concatenate(triangle_boxes(triangles)).astype(np.float64)[:, order]
    left, right, root = _insert(box.T.tolist())
    # A LooseTree's root is node 0: exchange node 0 and the root.
    left, right = np.array(left, np.int64), np.array(right, np.int64)
    names = np.arange(len(left))
    names[[0, root]] = names[[root, 0]]
    renamed = [np.where(child >= 0, names[child], -1)[names] for child in (left, right)]
    leaves = np.flatnonzero(renamed[0] < 0)
    return LooseTree(*renamed, (renamed[0] < 0).astype(np.int64), order[names[leaves]])


def _insert(boxes: list[list[float]]) -> tuple[list[int], list[int], int]:
    """Insert the boxes. Return each node's left child, each node's right child, and the root.

    Leaf i holds box i. The inner nodes follow the leaves.
    """
    n = len(boxes)
    lo_x, lo_y, lo_z, hi_x, hi_y, hi_z = (
        [box[i] for box in boxes] + [0.0] * (n - 1) for i in range(6))
    area = [0.0] * (2 * n - 1)
    size = [1] * n + [0] * (n - 1)
    left, right, parent = [-1] * (2 * n - 1), [-1] * (2 * n - 1), [-1] * (2 * n - 1)
    for i in range(n):
        x, y, z = hi_x[i] - lo_x[i], hi_y[i] - lo_y[i], hi_z[i] - lo_z[i]
        area[i] = x * y + y * z + z * x
    root = 0
    for leaf in range(1, n):
        x0, y0, z0, x1, y1, z1 = boxes[leaf]

        def joined(node: int) -> float:
            """Return the half area of the box of the node and the new triangle."""
            a, b = lo_x[node], hi_x[node]
            x = (b if b > x1 else x1) - (a if a < x0 else x0)
            a, b = lo_y[node], hi_y[node]
            y = (b if b > y1 else y1) - (a if a < y0 else y0)
            a, b = lo_z[node], hi_z[node]
            z = (b if b > z1 else z1) - (a if a < z0 else z0)
            return x * y + y * z + z * x

        node, grown = root, joined(root)
        inherited = 0.0                     # growth of the areas of all ancestors of `node`
        sibling, least = root, grown
        while left[node] >= 0:
            inherited += grown - area[node]
            if inherited >= least:
                break
            one, two = left[node], right[node]
            grown_one, grown_two = joined(one), joined(two)
            growth_one, growth_two = grown_one - area[one], grown_two - area[two]
            # On a tie, as with coincident triangles, descend into the smaller subtree.
            if growth_one < growth_two or (growth_one == growth_two and size[one] <= size[two]):
                node, grown = one, grown_one
            else:
                node, grown = two, grown_two
            if inherited + grown <= least:
                sibling, least = node, inherited + grown
        pair, above = n + leaf - 1, parent[sibling]
        left[pair], right[pair], parent[pair] = sibling, leaf, above
        parent[sibling] = parent[leaf] = pair
        size[pair] = size[sibling]
        lo_x[pair], lo_y[pair], lo_z[pair] = lo_x[sibling], lo_y[sibling], lo_z[sibling]
        hi_x[pair], hi_y[pair], hi_z[pair] = hi_x[sibling], hi_y[sibling], hi_z[sibling]
        if above < 0:
            root = pair
        elif left[above] == sibling:
            left[above] = pair
        else:
            right[above] = pair
        node = pair
        while node >= 0:
            x, y, z = lo_x[node], lo_y[node], lo_z[node]
            lo_x[node], lo_y[node] = x if x < x0 else x0, y if y < y0 else y0
            lo_z[node] = z if z < z0 else z0
            x, y, z = hi_x[node], hi_y[node], hi_z[node]
            hi_x[node], hi_y[node] = x if x > x1 else x1, y if y > y1 else y1
            hi_z[node] = z if z > z1 else z1
            x, y, z = hi_x[node] - lo_x[node], hi_y[node] - lo_y[node], hi_z[node] - lo_z[node]
            area[node] = x * y + y * z + z * x
            size[node] += 1
            node = parent[node]
    return left, right, root
