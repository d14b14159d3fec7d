"""Splits small nodes of Zhou's kd-tree by fragment passes, like kdtree/zhou_small.py."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....gl.algorithms.records import VALUES
from ....gl.algorithms.scan import scan
from ....gl.algorithms.streams import Stream, StreamRoom
from ..sah import WORTH_CUTTING
from ..zhou import ZhouRules
from .records import CHOICE, EXTENT, SIDES, SMALL_NODE
from .zhou_large import LargeNodes


@dataclass
class SmallLevel:
    """A level of small nodes: the small roots, or the children of the level above.

    Attributes
    ----------
    nodes : SMALL_NODE of each node
    choices : CHOICE of each node
    ranks : for each node, the number of split nodes before it
    inner : number of nodes that are split
    """

    nodes: Stream
    choices: Stream
    ranks: Stream
    inner: int


def grow_small(room: StreamRoom, large: LargeNodes, pieces: Stream,
               rules: ZhouRules) -> list[SmallLevel]:
    """Split small nodes and their descendants while it lowers the cost, within depth limits."""
    if not large.roots:
        return []
    nodes = room.stream(SMALL_NODE, large.roots)
    for depth, level in enumerate(large.levels):
        room.draw("zhou_roots", nodes, [level.cells, level.starts], first=level.first_root,
                  count=level.roots, cells=level.cells.length, first_root=level.first_root,
                  first_piece=level.first_piece, levels=rules.levels_below(depth))
    extents = room.stream(EXTENT, 3 * large.small_pieces)
    room.draw("zhou_extents", extents, [pieces])
    sides = room.stream(SIDES, extents.length)
    room.draw("zhou_masks", sides, [pieces, nodes, extents])
    levels = [_choose(room, nodes, extents, sides, rules)]
    while levels[-1].inner:
        above = levels[-1]
        nodes = room.stream(SMALL_NODE, 2 * above.inner)
        room.draw("zhou_halve", nodes, [above.nodes.called("old_node"), above.choices, above.ranks,
                                        sides], nodes=above.nodes.length)
        levels.append(_choose(room, nodes, extents, sides, rules))
    room.drop(extents, sides)
    return levels


def _choose(room: StreamRoom, nodes: Stream, extents: Stream, sides: Stream,
            rules: ZhouRules) -> SmallLevel:
    costs = rules.costs
    choices = room.stream(CHOICE, nodes.length)
    room.draw("zhou_choose", choices, [nodes, extents, sides],
              traversal_cost=costs.traversal, intersection_cost=costs.intersection,
              spared=1 - costs.empty_bonus, worth_cutting=np.float32(WORTH_CUTTING))
    flags = room.stream(VALUES, nodes.length)
    room.draw("zhou_inner", flags, [choices])
    ranks = scan(room, flags).called("ranks")
    room.drop(flags)
    return SmallLevel(nodes, choices, ranks, int(ranks.read_one(nodes.length)["value"][0]))
