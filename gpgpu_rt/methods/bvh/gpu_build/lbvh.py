"""LBVH by fragment passes (Lauterbach et al. 2009).

The tree equals the tree of `methods.bvh.lbvh`. Passes compute boxes and Morton codes, and sort the
codes. A slot is a place in the sorted order. A pass finds the parent and the slots of each node.
Six passes of pointer jumping count the ancestors that have the node in their left subtree;
thread.py turns these counts into depth-first positions and boxes.
"""
from __future__ import annotations

import numpy as np

from ....accel.options import in_range, refuse_unknown
from ....gl.algorithms.records import BOX, SORT_KEY, SOURCE, VALUES
from ....gl.algorithms.reduce import reduce_stream
from ....gl.algorithms.scan import scan
from ....gl.algorithms.sort import sort
from ....gl.algorithms.streams import Stream, StreamRoom
from ....traversal.triangle_table import TRIANGLE
from ..lbvh import AXIS_BITS, MAX_LEAF, SLOT_BITS, unit_exponent
from ..tree import Bvh
from .records import INTERVAL
from .thread import thread

DEPTH = 3 * AXIS_BITS + SLOT_BITS       # the tree has at most one level for each bit
JUMPS = (DEPTH - 1).bit_length()        # each jump doubles the path from a node to `parent`


def build(room: StreamRoom, triangles: np.ndarray, *, morton_bits: int = AXIS_BITS,
          max_leaf: int = MAX_LEAF, **unknown: object) -> Bvh:
    """Build by Morton codes, with the options of `methods.bvh.lbvh.build`."""
    refuse_unknown(build, unknown)
    morton_bits = in_range("morton_bits", morton_bits, 1, AXIS_BITS, int)
    max_leaf = in_range("max_leaf", max_leaf, 1, 64, int)
    source = upload(room, triangles)
    boxes = scaled_boxes(room, source, triangles)
    keys = sorted_keys(room, boxes, morton_bits)
    room.drop(boxes)
    inner, leaves, sums = radix_nodes(room, keys, max_leaf=max_leaf)
    order = room.stream(SOURCE, keys.length)
    room.draw("key_order", order, [keys])
    room.drop(keys)
    return thread(room, source, order, sums, max_leaf, [(inner, order.length), (leaves, max_leaf)])


def upload(room: StreamRoom, triangles: np.ndarray) -> Stream:
    """Upload (n, 3, 3) float32 triangles, in the scene's order, as a TRIANGLE stream."""
    v0, v1, v2 = triangles.transpose(1, 0, 2)
    return room.stream(TRIANGLE, len(triangles), v0=v0, v1=v1, v2=v2)


def scaled_boxes(room: StreamRoom, source: Stream, triangles: np.ndarray) -> Stream:
    """Return each triangle's BOX, scaled by 2^`unit_exponent` to avoid underflow and overflow."""
    boxes = room.stream(BOX, source.length)
    room.draw("triangle_boxes", boxes, [source],
              unit=float(np.ldexp(1.0, unit_exponent(triangles))))
    return boxes


def sorted_keys(room: StreamRoom, boxes: Stream, bits: int) -> Stream:
    """Return sorted SORT_KEYs: triangles with Morton codes of `bits` bits per axis."""
    centres = room.stream(VALUES, boxes.length)
    room.draw("centroids", centres, [boxes])
    low, high = (reduce_stream(room, centres, which).called(name)
                 for which, name in (("min", "low"), ("max", "high")))
    keys = room.stream(SORT_KEY, boxes.length)
    room.draw("morton_codes", keys, [boxes, low, high], bits=bits)
    room.drop(centres)
    return sort(room, keys)


def radix_nodes(room: StreamRoom, keys: Stream, max_leaf: int = 1,
                most_bits: int | None = None) -> tuple[Stream, Stream, Stream]:
    """Return the nodes of the tree over sorted codes.

    Parameters
    ----------
    max_leaf : nodes of at most this many triangles are leaves
    most_bits : replaces `max_leaf`: nodes whose codes share at least this many bits are leaves

    Returns
    -------
    gaps : for each gap between slots, the INTERVAL of its node; ``turns`` covers the path to the
        root
    leaves : for each slot, the INTERVAL of the leaf that begins there, if any
    sums : for each slot, the number of leaves that begin before the slot (a scan of flags)
    """
    slots = keys.length
    gaps, other = (room.stream(INTERVAL, slots - 1) for _ in range(2))
    room.draw("gaps", gaps, [keys], count=slots - 1, defines={"MOST_BITS": most_bits},
              slots=slots, max_leaf=max_leaf)
    for _ in range(JUMPS):
        room.draw("left_turns", other, [gaps], count=slots - 1)
        gaps, other = other, gaps
    room.drop(other)
    starts = room.stream(VALUES, slots)
    room.draw("leaf_starts", starts, [gaps])
    sums = scan(room, starts)
    leaves = room.stream(INTERVAL, slots)
    room.draw("leaves", leaves.called("leaf"), [keys, gaps, sums], slots=slots)
    return gaps, leaves, sums
