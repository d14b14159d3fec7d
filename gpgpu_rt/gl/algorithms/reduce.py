"""Reduction: the sum, minimum or maximum of a stream, in log n passes."""
from __future__ import annotations

from .records import VALUES
from .streams import Stream, StreamRoom

FAN = 8     # elements that become one in a pass
OPERATIONS = {"sum": "SUM", "min": "min", "max": "max"}


def reduce_stream(room: StreamRoom, values: Stream, operation: str) -> Stream:
    """One element: all of ``values``, channel by channel, under "sum", "min" or "max".

    Parameters
    ----------
    values : of the record VALUES, one element at least

    Sums are exact while they and all parts of them are integers up to 2^24.
    """
    while values.length > 1:
        values = reduce_once(room, values, operation)
    return values


def reduce_once(room: StreamRoom, values: Stream, operation: str = "sum") -> Stream:
    """One element for every FAN of ``values``."""
    reduced = room.stream(VALUES, -(-values.length // FAN))
    room.draw("algorithms/reduce", reduced.called("reduced"), [values.called("values")],
              count=reduced.length, defines={"FAN": FAN, "COMBINE": OPERATIONS[operation]},
              elements=values.length)
    return reduced
