"""Brings the nodes of Zhou's kd-tree into their final order by fragment passes.

Passes compute the sizes of subtrees from the leaves up, and the nodes' positions from the root
down. The next passes write each node to its position, and gather the references of all leaves.
"""
from __future__ import annotations

import numpy as np

from ....accel import tree_order
from ....gl.algorithms.records import SOURCE, VALUES
from ....gl.algorithms.scan import scan
from ....gl.algorithms.streams import Stream, StreamRoom
from ..records import KD_NODE
from ..tree import LEAF, KdTree
from ..zhou import ZhouRules
from .records import BUILT, PLACE
from .zhou_large import LargeNodes
from .zhou_small import SmallLevel


def finish(room: StreamRoom, large: LargeNodes, small: list[SmallLevel], pieces: Stream,
           rules: ZhouRules, box: tuple[np.ndarray, np.ndarray]) -> KdTree:
    """Return the finished tree, with pairs of siblings in depth-first order.

    pieces : PIECE, first the pieces of small nodes, then the pieces of large leaves
    """
    large_sizes, small_sizes = _sizes(room, large, small)
    large_places, small_places = _places(room, large, small, large_sizes, small_sizes)
    built = room.stream(BUILT, int(large_sizes[0].read_one(0)["value"][0]))
    for level, place in zip(large.levels, large_places):
        room.scatter("zhou_node", built, [level.cells, level.starts, level.decisions, level.ranks,
                                          place], level.cells.length, defines={"LARGE": 1},
                     small=level.small, first_stuck=large.small_pieces + level.first_stuck)
    for one, place in zip(small, small_places):
        room.scatter("zhou_node", built,
                     [one.nodes, one.choices, place], one.nodes.length)
    counts = room.stream(VALUES, built.length)
    room.draw("zhou_counts", counts, [built])
    sums = scan(room, counts)
    nodes = room.stream(KD_NODE, built.length)
    room.draw("zhou_finish", nodes, [built, sums])
    references = room.stream(SOURCE, int(sums.read_one(built.length)["value"][0]))
    room.draw("zhou_references", references,
              [built, sums, pieces], nodes=built.length)
    return _read(nodes, references, box)


def _sizes(room: StreamRoom, large: LargeNodes,
           small: list[SmallLevel]) -> tuple[list[Stream], list[Stream]]:
    """Return the number of nodes in each node's subtree, level by level."""
    large_sizes: list[Stream] = []
    small_sizes: list[Stream] = []
    nothing = room.stream(VALUES, 1).called("below")
    below = nothing
    for level in reversed(small):
        sizes = room.stream(VALUES, level.nodes.length)
        room.draw("zhou_sizes", sizes, [level.ranks, below])
        small_sizes.insert(0, sizes)
        below = sizes.called("below")
    roots, below = below.called("roots"), nothing
    for one in reversed(large.levels):
        sizes = room.stream(VALUES, one.cells.length)
        room.draw("zhou_sizes", sizes, [one.ranks, one.starts, below, roots],
                  defines={"LARGE": True}, first_root=one.first_root)
        large_sizes.insert(0, sizes)
        below = sizes.called("below")
    return large_sizes, small_sizes


def _places(room: StreamRoom, large: LargeNodes, small: list[SmallLevel],
            large_sizes: list[Stream],
            small_sizes: list[Stream]) -> tuple[list[Stream], list[Stream]]:
    """Return the PLACE of each node, level by level."""
    root = room.stream(PLACE, 1, at=np.array([0]), pair=np.array([1]))
    large_places = [root]
    for level, sizes in zip(large.levels, large_sizes[1:]):
        large_places.append(_below(room, level.ranks, large_places[-1], sizes))
    if not small:
        return large_places, []
    roots = room.stream(PLACE, large.roots)
    for level, places in zip(large.levels, large_places):
        room.draw("zhou_root_places", roots, [level.starts, places.called("above")],
                  first=level.first_root, count=level.roots, cells=level.cells.length,
                  first_root=level.first_root)
    small_places = [roots]
    for one, sizes in zip(small, small_sizes[1:]):
        small_places.append(_below(room, one.ranks, small_places[-1], sizes))
    return large_places, small_places


def _below(room: StreamRoom, ranks: Stream, above: Stream, sizes: Stream) -> Stream:
    """Return the PLACE of each child of a level's nodes."""
    places = room.stream(PLACE, sizes.length)
    room.draw("zhou_places", places, [ranks, above.called("above"), sizes.called("sizes")],
              nodes=above.length)
    return places


def _read(nodes: Stream, references: Stream, box: tuple[np.ndarray, np.ndarray]) -> KdTree:
    fields = nodes.read()
    axis, left = fields["axis"].astype(np.int8), fields["left"]
    first = np.where(axis == LEAF, -1, left)
    depth = len(tree_order.inner_levels(first, np.where(first < 0, -1, first + 1)))
    return KdTree(*box, axis, fields["split"], left, fields["count"],
                  references.read()["index"], depth)
