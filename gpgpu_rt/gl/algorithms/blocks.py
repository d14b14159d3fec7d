"""Stream reduction by blocks: removes elements from a stream and closes the gaps.

D. Roger, U. Assarsson, N. Holzschuch, "Efficient Stream Reduction on the GPU", 2007 (section 3.6
of Hachisuka's survey). A block has a constant number s of elements. The kept elements of a block
are adjacent in the result, so a line is drawn over their texels. Each fragment of the line finds
its element in the block in log s steps. The scan runs over the blocks' totals alone. `compact`
instead scans all n elements, and finds each element in log n steps.
"""
from __future__ import annotations

from collections.abc import Mapping

import moderngl

from ..record import Record
from ..textures import TABLE_WIDTH
from .records import VALUES
from .scan import scan
from .streams import Stream, StreamRoom, rows_of

BLOCK = 16      # texels of a block, with four elements each


def reduce_by_blocks(room: StreamRoom, stream: Stream, flags: Stream) -> Stream:
    """Return the elements of ``stream`` whose flag is 1, in order, as `compact` does.

    Parameters
    ----------
    flags : a stream of VALUES with 0 or 1 in the first channel for each element
    """
    record = stream.record
    defines = {"LOAD": f"{record.name}_load", "STORE": f"{record.name}_store"}
    ranks, starts, count = _ranks(room, flags.called("kept"), -(-stream.length // 4), {},
                                  elements=stream.length)
    kept = room.stream(record, count)
    _segments(room, kept, stream, ranks, starts, defines)
    return kept


def reduce_children(room: StreamRoom, children: Stream, count: int, pair: Record,
                    into: Stream | None = None) -> tuple[Stream, int]:
    """Return a stream of the pairs in the first ``count`` elements of ``children``, and the number
    of pairs. A pair is, for example, a triangle and a node of a hierarchy of rays.

    Parameters
    ----------
    pair : the record of a pair; an element of ``children`` holds up to four pairs
    into : a stream for the pairs; if it is too short, a new stream replaces it
    """
    defines = {"CHILDREN": True}
    ranks, starts, kept = _ranks(room, children, count, defines)
    if into is None or into.length < kept:
        if into is not None:
            room.drop(into)
        into = room.stream(pair, 1 << max(10, (kept - 1).bit_length()))
    _segments(room, into, children, ranks, starts, defines)
    return into, kept


def _ranks(room: StreamRoom, source: Stream, texels: int, defines: Mapping[str, object],
           **uniforms: object) -> tuple[Stream, Stream, int]:
    """Return the kept elements' ranks in their blocks (four per texel), each block's start in the
    result, and the number of kept elements."""
    flags = room.stream(VALUES, texels).called("flags")
    room.draw("algorithms/block_flags", flags, [source], count=texels, defines=defines, **uniforms)
    ranks = room.stream(VALUES, texels).called("ranks")
    room.draw("algorithms/block_ranks", ranks, [flags], count=texels, defines={"BLOCK": BLOCK})
    totals = room.stream(VALUES, -(-texels // BLOCK)).called("totals")
    room.draw("algorithms/block_totals", totals, [ranks], count=totals.length,
              defines={"BLOCK": BLOCK}, texels=texels)
    starts = scan(room, totals).called("starts")
    room.drop(flags, totals)
    ranks.length = texels
    return ranks, starts, int(starts.read_one(starts.length - 1)["value"][0])


def _segments(room: StreamRoom, target: Stream, source: Stream, ranks: Stream, starts: Stream,
              defines: Mapping[str, object]) -> None:
    """Draw a line for each block, split in two at the end of a row. Drop `ranks` and `starts`."""
    target.framebuffer.viewport = (0, 0, 2 * TABLE_WIDTH, rows_of(target.length))
    room.scatter("algorithms/segments", target, [source, ranks, starts], 4 * (starts.length - 1),
                 mode=moderngl.LINES, defines={"BLOCK": BLOCK, **defines}, texels=ranks.length)
    target.framebuffer.viewport = (0, 0, TABLE_WIDTH, rows_of(target.length))
    room.drop(ranks, starts)
