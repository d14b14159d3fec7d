"""Hybrid build by fragment passes (Lauterbach et al. 2009): LBVH for upper levels, SAH below them.

A cluster holds the triangles whose Morton codes, of a few bits per axis, are equal. LBVH builds
the tree over clusters; then SAH splits the clusters.
"""
from __future__ import annotations

import numpy as np

from ....accel.options import in_range
from ....gl.algorithms.compact import gather, kept_sources
from ....gl.algorithms.streams import StreamRoom
from ..hybrid import CLUSTER_BITS
from ..lbvh import AXIS_BITS
from ..tree import Bvh
from .lbvh import radix_nodes, scaled_boxes, sorted_keys, upload
from .records import SLOT
from .sah import Splitting
from .thread import thread


def build(room: StreamRoom, triangles: np.ndarray, *, morton_bits: int = CLUSTER_BITS,
          **options: object) -> Bvh:
    """Build by Morton codes and SAH, with the options of `methods.bvh.hybrid.build`."""
    morton_bits = in_range("morton_bits", morton_bits, 1, AXIS_BITS, int)
    source = upload(room, triangles)
    boxes = scaled_boxes(room, source, triangles)
    splitting = Splitting(room, boxes, **options)
    keys = sorted_keys(room, boxes, morton_bits)
    above, begins, sums = radix_nodes(room, keys, most_bits=3 * morton_bits)
    clusters = gather(room, begins, kept_sources(room, sums))
    slots = room.stream(SLOT, keys.length)
    room.draw("sah_clusters", slots, [keys, sums])
    below, order, sums = splitting.run(slots, clusters)
    count = keys.length
    return thread(room, source, order, sums, splitting.rule["max_leaf"],
                  [(above, count), (below, count)])
