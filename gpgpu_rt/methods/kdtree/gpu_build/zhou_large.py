"""Splits the large nodes of Zhou's kd-tree by fragment passes, a whole level at once.

A piece is a triangle's entry in a node, with the box of the triangle's part in the node. A chunk
is at most CHUNK_PIECES consecutive pieces of a large node."""
from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ....accel.bounds import scene_box
from ....gl.algorithms.records import VALUES
from ....gl.algorithms.scan import scan
from ....gl.algorithms.streams import Stream, StreamRoom
from .. import zhou as cpu
from ..tree import MOST_REFERENCES
from .records import CELL, CHUNK, DECISION, PIECE

CHUNK_PIECES = 256


@dataclass
class LargeLevel:
    """The nodes of one depth: large nodes, and small nodes whose parents are large.

    Attributes
    ----------
    cells : CELL of each node.
    starts : VALUES of each node, four sums over the nodes before it in the level: pieces of large
        nodes, pieces of small nodes, small nodes that have pieces, and chunks.
    first_root : Number of small nodes in all levels above.
    first_piece : Number of pieces of small nodes in all levels above.
    roots : Number of small nodes.
    decisions : DECISION of each node.
    ranks : VALUES of each node, two sums over the nodes before it in the level: split nodes, and
        pieces of large leaves.
    first_stuck : Number of pieces of large leaves in all levels above.
    inner : Number of split nodes.
    small : A threshold: a node with at most this many pieces is small.
    """

    cells: Stream
    starts: Stream
    first_root: int
    first_piece: int
    roots: int
    decisions: Stream
    ranks: Stream
    first_stuck: int
    inner: int
    small: int


@dataclass
class LargeNodes:
    """The result of `grow_large`: the levels, and the pieces of small nodes and large leaves.

    Attributes
    ----------
    levels : All levels, from the root down.
    small : Pieces of small nodes, a stream for each level below the root. If the root is small,
        the only stream holds the root's pieces.
    stuck : Pieces of large nodes that became leaves, a stream for each level that has such pieces.
    roots : Number of small nodes, which are the roots of the trees in `zhou_small`.
    """

    levels: list[LargeLevel] = field(default_factory=list)
    small: list[Stream] = field(default_factory=list)
    stuck: list[Stream] = field(default_factory=list)
    roots: int = 0

    @property
    def small_pieces(self) -> int:
        return sum(pieces.length for pieces in self.small)

    @property
    def stuck_pieces(self) -> int:
        return sum(pieces.length for pieces in self.stuck)


class Halving:
    """Splits large nodes as Zhou does: cuts off empty space, or halves a node's longest side."""

    prefixes = False    # whether the field ``futile`` of a CELL holds a prefix of Morton codes

    def __init__(self, rules: cpu.ZhouRules) -> None:
        self.rules = rules

    def small(self, depth: int) -> int:
        """Return the threshold: a node at this depth with at most this many pieces is small."""
        return self.rules.small

    def decide(self, room: StreamRoom, cells: Stream, starts: Stream, pieces: Stream, chunks: int,
               depth: int, stop: bool) -> Stream:
        """Return the DECISION of each node of a level. With ``stop``, no node is split."""
        bounds = chunk_bounds(room, cells, starts, pieces, chunks)
        decisions = room.stream(DECISION, cells.length)
        room.draw("zhou_decide", decisions, [cells, starts, bounds], small=self.small(depth),
                  empty_cut=self.rules.empty_cut, most_futile=cpu.FUTILE, stop=stop)
        room.drop(bounds)
        return decisions


def grow_large(room: StreamRoom, source: Stream, triangles: np.ndarray, rules: cpu.ZhouRules,
               way: Halving) -> LargeNodes:
    """Split the root, and all large nodes below it."""
    found = LargeNodes()
    lo, hi = scene_box(triangles)
    cells = room.stream(CELL, 1, lo=lo[None], hi=hi[None], count=np.array([len(triangles)]))
    starts, counts = _starts(room, cells, way.small(0))
    pieces = room.stream(PIECE, len(triangles))
    room.draw("zhou_pieces", pieces, [source], pad=rules.pad)
    if not counts[0]:
        found.small.append(pieces)
    limit = MOST_REFERENCES * len(triangles) + 4096
    while True:
        depth = len(found.levels)
        kept = found.small_pieces + found.stuck_pieces
        stop = depth >= rules.large_depth or kept + counts[0] > limit
        decisions = way.decide(room, cells, starts, pieces, counts[3], depth, stop)
        level = _level(room, found, cells, starts, pieces, counts, decisions, way.small(depth))
        found.levels.append(level)
        found.roots += counts[2]
        if not level.inner:
            if counts[0]:       # else `found` holds them: the root is small
                room.drop(pieces)
            return found
        cells, starts, pieces, counts = _children(room, found, level, pieces, source, rules, way)


def _starts(room: StreamRoom, cells: Stream, small: int) -> tuple[Stream, tuple[int, ...]]:
    """Return `LargeLevel.starts` of the nodes, and the level's four totals."""
    quantities = room.stream(VALUES, cells.length)
    room.draw("zhou_quantities", quantities, [cells], defines={"CHUNK": CHUNK_PIECES},
              small=small)
    sums = scan(room, quantities)
    room.drop(quantities)
    return sums.called("starts"), _totals(sums)


def _totals(sums: Stream) -> tuple[int, ...]:
    """Read back the last entry of a scan."""
    return tuple(int(value) for value in sums.read_one(sums.length - 1)["value"])


def chunk_bounds(room: StreamRoom, cells: Stream, starts: Stream, pieces: Stream,
                 count: int) -> Stream:
    """Return the CHUNK of each of the ``count`` chunks of large nodes."""
    chunks = room.stream(CHUNK, max(count, 1))
    room.draw("zhou_chunks", chunks, [cells, starts, pieces], count=count,
              defines={"CHUNK": CHUNK_PIECES}, cells=cells.length)
    return chunks


def _level(room: StreamRoom, found: LargeNodes, cells: Stream, starts: Stream, pieces: Stream,
           counts: tuple[int, ...], decisions: Stream, small: int) -> LargeLevel:
    """Return the level of these cells. Add the pieces of large leaves to `found.stuck`."""
    small_pieces = found.small_pieces - counts[1]     # in the levels above
    flags = room.stream(VALUES, cells.length)
    room.draw("zhou_flags", flags, [cells, decisions], small=small)
    ranks = scan(room, flags).called("ranks")
    room.drop(flags)
    inner, stuck, *_ = _totals(ranks)
    level = LargeLevel(cells, starts, found.roots, small_pieces, counts[2], decisions, ranks,
                       found.stuck_pieces, inner, small)
    if stuck:
        left = room.stream(PIECE, stuck)
        room.draw("zhou_stuck", left, [starts, ranks, pieces.called("old_piece")],
                  cells=cells.length)
        found.stuck.append(left)
    return level


def _children(room: StreamRoom, found: LargeNodes, level: LargeLevel, pieces: Stream,
              source: Stream, rules: cpu.ZhouRules, way: Halving
              ) -> tuple[Stream, Stream, Stream, tuple[int, ...]]:
    """Return the cells, starts, pieces and totals of the level below."""
    sides = room.stream(VALUES, pieces.length)
    room.draw("zhou_sides", sides,
              [pieces, level.decisions, source], slack=rules.slack)
    sums = scan(room, sides)
    cells = room.stream(CELL, 2 * level.inner)
    room.draw("zhou_cells", cells, [level.cells.called("parent_cell"), level.decisions,
                                    level.starts, level.ranks, sums],
              defines={"PREFIXES": way.prefixes}, cells=level.cells.length)
    starts, counts = _starts(room, cells, way.small(len(found.levels)))
    reads = [cells, starts.called("next_starts"), level.starts, level.decisions, sums,
             pieces.called("old_piece"), source]
    parts = [room.stream(PIECE, count) for count in counts[:2]]
    for channel, part in enumerate(parts):
        room.draw("zhou_parts", part, reads, defines={"CHANNEL": channel}, cells=cells.length,
                  first_root=found.roots, slack=rules.slack)
    found.small.append(parts[1])
    room.drop(sides, sums, pieces)
    return cells, starts, parts[0], counts


def joined(room: StreamRoom, lists: list[Stream]) -> Stream:
    """Concatenate streams of pieces into one stream, and release the old streams."""
    whole, first = room.stream(PIECE, sum(pieces.length for pieces in lists)), 0
    for pieces in lists:
        room.draw("zhou_append", whole, [pieces.called("old_piece")], first=first, offset=first,
                  count=pieces.length)
        first += pieces.length
    room.drop(*lists)
    return whole
