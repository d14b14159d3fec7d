"""Threading: from nodes that span slots to the finished hierarchy, boxes and escape indices.

Any tree over slots in order will do. A node's place in depth-first order follows from how many
leaves begin before it and how many of its ancestors have it on their left; its box from the boxes
of runs of 4^k slots, of which four cover it. So neither needs the tree level by level.
"""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ....errors import LimitError
from ....gl.algorithms.records import BOX, SOURCE
from ....gl.algorithms.streams import Stream, StreamRoom
from ....gl.record import EXACT_INTEGER
from ..records import BVH_NODE
from ..tree import Bvh


def thread(room: StreamRoom, triangles: Stream, order: Stream, sums: Stream,
           max_leaf: int, lists: Sequence[tuple[Stream, int]]) -> Bvh:
    """The hierarchy of all nodes in the lists, read back.

    Parameters
    ----------
    triangles : TRIANGLE, as uploaded
    order : SOURCE, the triangle in each slot
    sums : scan of the flags of slots that begin a leaf
    max_leaf : no leaf holds more triangles
    lists : INTERVAL each, nodes in any order, those with first = -1 are none; and the most slots
        that one of them spans
    """
    slots = order.length
    leaf_count = int(sums.read_one(slots)["value"][0])
    nodes = 2 * leaf_count - 1
    if nodes > EXACT_INTEGER:
        raise LimitError(f"{nodes:,} nodes are past 2^24, the last index a float texel holds "
                         "exactly; take leaves of more triangles")
    threaded = room.stream(BVH_NODE, nodes)
    boxes = [room.stream(BOX, part.length).called("node_box") for part, _ in lists]
    runs, other = (room.stream(BOX, slots) for _ in range(2))
    room.draw("triangle_boxes", runs,
              [triangles, order], defines={"ORDERED": True}, unit=1.0)
    run = 1
    while run <= slots:
        for (part, longest), box in zip(lists, boxes):
            if longest >= run:
                room.draw("node_boxes", box, [runs, part], run=run)
        run *= 4
        if run <= slots:
            room.draw("box_runs", other, [runs], slots=slots, run=run // 4)
            runs, other = other, runs
    room.drop(runs, other)
    for (part, _), box in zip(lists, boxes):
        room.scatter("thread", threaded,
                     [part, box, sums], part.length, nodes=nodes)
    ascending = room.stream(SOURCE, slots)
    room.draw("leaf_order", ascending,
              [order, sums], slots=slots, max_leaf=max_leaf)
    return pack(threaded.read(), ascending.read()["index"])


def pack(nodes: dict[str, np.ndarray], order: np.ndarray) -> Bvh:
    """The record from nodes in depth-first order, fields as in BVH_NODE, and each slot's
    triangle."""
    total = len(nodes["first"])
    escape = np.where(nodes["escape"] < 0, total, nodes["escape"])
    leaves = np.flatnonzero(nodes["first"] >= 0)
    first, count = (np.zeros(total, np.int32) for _ in range(2))
    first[leaves] = nodes["first"][leaves]
    count[leaves] = np.diff(nodes["first"][leaves], append=len(order))
    # A node is below all inner nodes before it whose subtree does not end before it.
    opened = np.cumsum(count == 0) - (count == 0)
    inner = np.flatnonzero(count == 0)
    closed = np.cumsum(np.bincount(escape[inner], minlength=total + 1))[:total]
    return Bvh(nodes["lo"], nodes["hi"], escape.astype(np.int32), first, count, order,
               int((opened - closed).max()))
