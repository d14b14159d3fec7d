"""Reduction: computes the sum, minimum or maximum of a stream, in log n passes."""
from __future__ import annotations

from .records import VALUES
from .streams import Stream, StreamRoom

FAN = 8     # elements that a pass combines into one
OPERATIONS = {"sum": "SUM", "min": "min", "max": "max"}


def reduce_stream(room: StreamRoom, values: Stream, operation: str) -> Stream:
    """Return a stream of one element: the "sum", "min" or "max" of ``values`` in each channel.

    Sums are exact if all partial sums are integers up to 2^24.

    Parameters
    ----------
    values : a stream of VALUES with at least one element
    """
    while values.length > 1:
        values = reduce_once(room, values, operation)
    return values


def reduce_once(room: StreamRoom, values: Stream, operation: str = "sum") -> Stream:
    """Return a stream with one combined element for every FAN of ``values``."""
    reduced = room.stream(VALUES, -(-values.length // FAN))
    room.draw("algorithms/reduce", reduced.called("reduced"), [values.called("values")],
              count=reduced.length, defines={"FAN": FAN, "COMBINE": OPERATIONS[operation]},
              elements=values.length)
    return reduced
