"""Hybrid build: Morton codes give the upper levels, and SAH splits the levels below.

C. Lauterbach, M. Garland, S. Sengupta, D. Luebke, D. Manocha, "Fast BVH Construction on GPUs",
Eurographics 2009. Triangles whose codes share the first few bits form a cluster. LBVH builds the
tree over the clusters, and SAH splits each cluster. Under SAH alone, the first levels have too few
nodes to occupy a GPU.
"""
from __future__ import annotations

import numpy as np

from ...accel.options import in_range
from . import sah as sah_bvh
from . import top_down
from .lbvh import AXIS_BITS, RadixTree, sorted_codes
from .tree import LooseTree

CLUSTER_BITS = 2        # bits per axis that the triangles of a cluster share


def build(triangles: np.ndarray, *, morton_bits: int = CLUSTER_BITS,
          **options: object) -> LooseTree:
    """Build clusters by Morton codes and split each cluster as `sah_bvh.build` does.

    morton_bits : bits per axis that the triangles of a cluster share
    options : options of `sah_bvh.build`; `max_depth` counts the levels below the clusters
    """
    morton_bits = in_range("morton_bits", morton_bits, 1, AXIS_BITS, int)
    split = sah_bvh.splitter(**options)
    if len(triangles) == 0:
        return top_down.build(triangles, split)
    code, order = sorted_codes(triangles, morton_bits)
    radix = RadixTree.of(code)
    kept = radix.bits < 3 * morton_bits
    cluster = np.empty(len(order), np.int64)
    cluster[order] = np.cumsum(np.append(False, kept))
    above = radix.cut(kept, order)
    below = top_down.build(triangles, split, cluster)
    # The clusters are the last nodes of `above` and the first nodes of `below`.
    shift = int(kept.sum())
    left, right = (np.concatenate([upper[:shift], np.where(lower < 0, -1, lower + shift)])
                   for upper, lower in ((above.left, below.left), (above.right, below.right)))
    return LooseTree(left, right, np.concatenate([above.count[:shift], below.count]),
                     below.triangle)
