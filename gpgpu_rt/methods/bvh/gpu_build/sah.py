"""SAH build by fragment passes, which process all nodes of a level together.

Lauterbach et al. 2009. A slot is a place in the order of triangles. Nodes of more than SMALL
triangles are binned: a point for each slot and axis is blended into a bin of the slot's node. In
smaller nodes, each slot tries a split per axis, with its triangle as the last on the left side. A
scan of flags partitions the slots of a node. The host reads back two numbers per level: the binned
nodes and the split nodes.
"""
from __future__ import annotations

import moderngl
import numpy as np

from ....accel.options import in_range, refuse_unknown
from ....gl.algorithms.compact import kept_sources
from ....gl.algorithms.records import BOX, SOURCE, VALUES
from ....gl.algorithms.scan import scan
from ....gl.algorithms.streams import Stream, StreamRoom
from ..tree import Bvh
from .lbvh import scaled_boxes, upload
from .records import BIN, INTERVAL, SLOT, SPLIT
from .thread import thread

# Nodes of at most this many triangles are not binned; Lauterbach et al. use local work queues for
# them.
SMALL = 32
FAR = 3e38


def build(room: StreamRoom, triangles: np.ndarray, **options: object) -> Bvh:
    """Build by SAH, with the options of `methods.bvh.sah.build`."""
    source = upload(room, triangles)
    boxes = scaled_boxes(room, source, triangles)
    count = len(triangles)
    slots = room.stream(SLOT, count, triangle=np.arange(count))
    root = room.stream(INTERVAL, 1, first=[0], last=[count - 1], parent=[-1])
    splitting = Splitting(room, boxes, **options)
    nodes, order, sums = splitting.run(slots, root)
    return thread(room, source, order, sums, splitting.rule["max_leaf"], [(nodes, count)])


class Splitting:
    """Splits nodes until all nodes are leaves.

    Parameters
    ----------
    boxes : the BOX of each triangle, from `scaled_boxes`
    other parameters : as in `methods.bvh.sah.build`; the nodes given to `run` have depth 0
    """

    def __init__(self, room: StreamRoom, boxes: Stream, *, bins: int = 32, max_leaf: int = 4,
                 traversal_cost: float = 1.0, intersection_cost: float = 1.0,
                 max_depth: int = 64, **unknown: object) -> None:
        refuse_unknown(Splitting, unknown)
        self.room, self.boxes = room, boxes
        self.defines = {"SMALL": SMALL, "BINS": in_range("bins", bins, 2, 64, int)}
        self.rule = {"max_leaf": in_range("max_leaf", max_leaf, 1, 64, int),
                     "traversal_cost": in_range("traversal_cost", traversal_cost, 0, 1e6),
                     "intersection_cost": in_range("intersection_cost", intersection_cost, 1e-6,
                                                   1e6),
                     "max_depth": in_range("max_depth", max_depth, 0, 1024, int)}

    def run(self, slots: Stream, level: Stream) -> tuple[Stream, Stream, Stream]:
        """Split the nodes of ``level`` and all nodes below them.

        Parameters
        ----------
        slots : SLOT, each in a node of ``level``; this stream is released
        level : INTERVAL of the nodes, with valid `turns`; this stream is released

        Returns
        -------
        nodes : the INTERVAL of every node of ``level`` and below
        order : SOURCE, the triangle of each slot
        sums : for each slot, the number of leaves that begin before the slot (a scan of flags)
        """
        room, count = self.room, slots.length
        nodes = room.stream(INTERVAL, 2 * count - 1)
        made, depth = 0, 0
        while level.length:
            room.draw("append", nodes, [level.called("level")], first=made, count=level.length,
                      base=made)
            made += level.length
            slots, level = self._split(slots, level, depth)
            depth += 1
        order, starts = room.stream(SOURCE, count), room.stream(VALUES, count)
        room.draw("sah_order", order, [slots])
        room.draw("sah_starts", starts, [slots])
        nodes.length = made
        return nodes, order, scan(room, starts)

    def _split(self, slots: Stream, level: Stream, depth: int) -> tuple[Stream, Stream]:
        """Return the slots and nodes of the next level, and release ``slots`` and ``level``."""
        room, count, defines = self.room, slots.length, self.defines
        flags = room.stream(VALUES, level.length)
        room.draw("sah_large", flags, [level], defines=defines)
        large = scan(room, flags).called("large")
        bins, costs = self._binned(slots, level, large)
        sweep = room.stream(VALUES, count).called("sweep")
        room.draw("sah_sweep", sweep,
                  [slots, level, self.boxes], defines=defines)
        split = room.stream(SPLIT, level.length)
        room.draw("sah_split", split, [level, large, costs, sweep], defines=defines, level=depth,
                  **self.rule)
        side = room.stream(VALUES, count)
        room.draw("sah_sides", side.called("side"), [slots, level, split, bins, self.boxes],
                  defines=defines)
        sums = scan(room, side)
        inner = room.stream(VALUES, level.length)
        room.draw("sah_inner", inner, [split])
        ranks = scan(room, inner)
        parted = room.stream(SLOT, count)
        room.draw("sah_partition", parted,
                  [slots, level, split, sums, ranks.called("ranks")])
        sources = kept_sources(room, ranks)
        children = room.stream(INTERVAL, 2 * sources.length)
        room.draw("sah_children", children, [sources, level, split])
        room.drop(slots, level, flags, large, bins, costs, sweep, split, side, sums, inner, ranks,
                  sources)
        return parted, children

    def _binned(self, slots: Stream, level: Stream, large: Stream) -> tuple[Stream, Stream]:
        """Return VALUES streams: each slot's bins, and each binned node's best split per axis."""
        room, defines, context = self.room, self.defines, self.room.gpu.context
        nodes = int(large.read_one(level.length)["value"][0])
        bins = room.stream(VALUES, slots.length)
        costs = room.stream(VALUES, 3 * nodes).called("costs")
        if not nodes:
            return bins, costs
        ranges = room.stream(BOX, nodes).called("range")
        cells = room.stream(BIN, 3 * nodes * defines["BINS"])
        context.enable_only(moderngl.BLEND)
        context.blend_func = moderngl.ONE, moderngl.ONE
        context.blend_equation = moderngl.MIN, moderngl.FUNC_ADD
        ranges.clear(FAR, FAR, FAR, 0.0)
        room.scatter("sah_ranges", ranges, [slots, level, large, self.boxes], slots.length,
                     defines=defines)
        context.enable_only(moderngl.NOTHING)
        room.draw("sah_bins", bins,
                  [slots, level, large, ranges, self.boxes], defines=defines)
        context.enable_only(moderngl.BLEND)
        cells.clear(FAR, FAR, FAR, 0.0)
        room.scatter("sah_fill", cells, [slots, bins, self.boxes], 3 * slots.length,
                     defines=defines)
        context.enable_only(moderngl.NOTHING)
        room.draw("sah_costs", costs, [cells], defines=defines)
        room.drop(ranges, cells)
        return bins, costs
