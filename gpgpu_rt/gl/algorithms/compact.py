"""Stream reduction: moves the kept elements together, in order."""
from __future__ import annotations

from .records import SOURCE
from .scan import scan
from .streams import Stream, StreamRoom


def compact(room: StreamRoom, stream: Stream, flags: Stream) -> Stream:
    """Return the elements of ``stream`` whose flag is 1 (D. Horn, GPU Gems 2, 2005).

    The host reads back the number of kept elements, because a draw needs this number.

    Parameters
    ----------
    flags : a stream of VALUES with 0 or 1 in the first channel for each element
    """
    sums = scan(room, flags)
    sources = kept_sources(room, sums)
    kept = gather(room, stream, sources)
    room.drop(sums, sources)
    return kept


def kept_sources(room: StreamRoom, sums: Stream) -> Stream:
    """Return the index (SOURCE) of every kept element, from the scan of the flags."""
    kept = int(sums.read_one(sums.length - 1)["value"][0])
    sources = room.stream(SOURCE, kept)
    room.draw("algorithms/source", sources,
              [sums.called("sums")], count=kept, elements=sums.length - 1)
    return sources


def gather(room: StreamRoom, stream: Stream, sources: Stream) -> Stream:
    """Return a stream whose element i is element ``sources[i]`` of ``stream``."""
    record = stream.record
    gathered = room.stream(record, sources.length)
    room.draw("algorithms/gather", gathered, [stream, sources], count=sources.length,
              defines={"LOAD": f"{record.name}_load", "STORE": f"{record.name}_store"})
    return gathered
