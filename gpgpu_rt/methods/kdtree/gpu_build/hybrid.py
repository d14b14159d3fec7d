"""Hybrid kd-tree by fragment passes: Morton codes give the upper levels, SAH the levels below.

The build follows `methods.kdtree.hybrid`, with the passes of Zhou's build. In the upper levels, a
node's prefix of Morton codes selects the lattice plane that halves the node. In the levels below,
binned SAH splits the large nodes, which have more than `FEW` pieces. A piece is a triangle's entry
in a node, with the box of the triangle's part in the node. Zhou's passes with masks (a bit per
piece) split the smaller nodes: they try every face of every piece's box.

Departure from the CPU: splits of small nodes do not clip triangles. The trees therefore cost a few
percent more (docs/kd-trees.md), but give the same hits.
"""
from __future__ import annotations

import numpy as np

from ....accel.bounds import padding
from ....accel.options import choose, in_range, refuse_unknown
from ....gl.algorithms.records import BOX, VALUES
from ....gl.algorithms.streams import Stream, StreamRoom
from .. import hybrid as cpu
from ..sah import FEW, WORTH_CUTTING, Costs
from ..sah_growth import sah_costs
from ..tree import KdTree, depth_cap
from ..zhou import ZhouRules
from .records import DECISION, OFFER, TALLIES
from .zhou import build_by
from .zhou_large import CHUNK_PIECES, Halving, chunk_bounds

MOST_BINS = 63


def build(room: StreamRoom, triangles: np.ndarray, *, morton_bits: int = cpu.MORTON_BITS,
          split: str = "binned", bins: int = 32, traversal_cost: float = Costs.traversal,
          intersection_cost: float = Costs.intersection, empty_bonus: float = Costs.empty_bonus,
          max_depth: int | None = None,
          **unknown: object) -> KdTree:
    """Build with the options of `methods.kdtree.hybrid.build`. ``split`` must be "binned"."""
    refuse_unknown(build, unknown)
    choose("split on the gpu", split, ("binned",))
    deepest = depth_cap(triangles, max_depth)
    rules = ZhouRules(sah_costs(traversal_cost, intersection_cost, empty_bonus), deepest, deepest,
                      deepest, FEW, np.float32(0), padding(triangles))
    bits = min(in_range("morton_bits", morton_bits, 1, cpu.MOST_BITS, int), deepest // 3)
    way = Codes(room, rules, triangles, bits, in_range("bins", bins, 2, MOST_BINS, int))
    return build_by(room, triangles, rules, way)


class Codes(Halving):
    """Splits large nodes by codes in the upper levels, then by binned SAH."""

    prefixes = True

    def __init__(self, room: StreamRoom, rules: ZhouRules, triangles: np.ndarray, bits: int,
                 bins: int) -> None:
        super().__init__(rules)
        self.bits = bits
        lattice = cpu.lattice(triangles, bits)
        self.planes = room.stream(VALUES, len(lattice),
                                  value=np.pad(lattice, ((0, 0), (0, 1)))).called("planes")
        self.groups = {"BINS": bins, "GROUPS": bins // 4 + 1}

    def small(self, depth: int) -> int:
        """Return the threshold of `Halving`, or 0 at depths where codes split every node."""
        return 0 if depth < 3 * self.bits else self.rules.small

    def decide(self, room: StreamRoom, cells: Stream, starts: Stream, pieces: Stream, chunks: int,
               depth: int, stop: bool) -> Stream:
        decisions = room.stream(DECISION, cells.length)
        if depth < 3 * self.bits:
            room.draw("hybrid_halve", decisions,
                      [cells, self.planes], level=depth, bits=self.bits)
        else:
            self._weigh(room, cells, starts, pieces, chunks, decisions, stop)
        return decisions

    def _weigh(self, room: StreamRoom, cells: Stream, starts: Stream, pieces: Stream, chunks: int,
               decisions: Stream, stop: bool) -> None:
        groups, costs = self.groups["GROUPS"], self.rules.costs
        bounds = chunk_bounds(room, cells, starts, pieces, chunks)
        boxes = room.stream(BOX, cells.length)
        room.draw("hybrid_bounds", boxes, [starts, bounds])
        tallies = room.stream(TALLIES, groups * max(chunks, 1))
        room.draw("hybrid_bins", tallies, [cells, starts, pieces, boxes], count=groups * chunks,
                  defines={"CHUNK": CHUNK_PIECES, **self.groups}, cells=cells.length)
        offers = room.stream(OFFER, groups * cells.length)
        room.draw("hybrid_costs", offers, [cells, starts, tallies, boxes], defines=self.groups,
                  traversal_cost=costs.traversal, intersection_cost=costs.intersection,
                  spared=1 - costs.empty_bonus, worth_cutting=np.float32(WORTH_CUTTING))
        room.draw("hybrid_decide", decisions, [cells, offers], defines=self.groups,
                  intersection_cost=costs.intersection, small=self.rules.small, stop=stop)
        room.drop(bounds, boxes, tallies, offers)
