"""Threading: gives the nodes of a tree boxes, escape indices and depth-first order.

A slot is a place in the order of triangles; each node spans consecutive slots. A node's position
in depth-first order is twice the number of leaves that begin before the node, plus the number of
ancestors that have the node in their left subtree. A node's box is the union of the boxes of four
runs of 4^k consecutive slots, which may overlap. So there is no pass per level.
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
    """Thread all nodes of the lists, and read back the hierarchy.

    Parameters
    ----------
    triangles : TRIANGLE, in the scene's order
    order : SOURCE, the triangle in each slot
    sums : VALUES, the number of leaves that begin before each slot; the last value is the total
    max_leaf : the largest number of triangles in a leaf
    lists : pairs: a stream of nodes (INTERVAL) in any order, and the most slots that a node spans;
        entries with first = -1 are skipped

    Raises
    ------
    LimitError
        if the hierarchy has more nodes than a float texel can index exactly
    """
    slots = order.length
    leaf_count = int(sums.read_one(slots)["value"][0])
    nodes = 2 * leaf_count - 1
    if nodes > EXACT_INTEGER:
        raise LimitError(f"{nodes:,} nodes are more than 2^24, the largest index that a float "
                         "texel holds exactly; allow leaves of more triangles")
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
    """Return the hierarchy of nodes (fields of BVH_NODE, in depth-first order) and triangles.

    ``order`` has the triangle in each slot.
    """
    total = len(nodes["first"])
    escape = np.where(nodes["escape"] < 0, total, nodes["escape"])
    leaves = np.flatnonzero(nodes["first"] >= 0)
    first, count = (np.zeros(total, np.int32) for _ in range(2))
    first[leaves] = nodes["first"][leaves]
    count[leaves] = np.diff(nodes["first"][leaves], append=len(order))
    # A node's depth is the number of inner nodes whose subtrees contain it.
    opened = np.cumsum(count == 0) - (count == 0)
    inner = np.flatnonzero(count == 0)
    closed = np.cumsum(np.bincount(escape[inner], minlength=total + 1))[:total]
    return Bvh(nodes["lo"], nodes["hi"], escape.astype(np.int32), first, count, order,
               int((opened - closed).max()))
