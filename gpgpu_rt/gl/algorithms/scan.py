"""Scan: computes prefix sums, the first step of stream reduction and partition."""
from __future__ import annotations

from .records import VALUES
from .reduce import FAN, reduce_once
from .streams import Stream, StreamRoom


def scan(room: StreamRoom, values: Stream) -> Stream:
    """Return the exclusive prefix sums, n + 1 elements called "sums". The last sum is the total.

    Make levels upwards: an element of a level is the sum of a block of the level below. Then
    compute prefix sums downwards (G. Blelloch, "Prefix Sums and Their Applications", 1990): add
    the earlier elements of the block to the sum of all earlier blocks, which the level above
    holds. Sums are exact if they are integers up to 2^24.

    Parameters
    ----------
    values : n elements of the record VALUES; the four channels are summed separately
    """
    levels = [values]
    while levels[-1].length >= FAN:
        levels.append(reduce_once(room, levels[-1]))
    carry: list[Stream] = []
    for level in reversed(levels):
        sums = room.stream(VALUES, level.length + 1).called("sums")
        room.draw("algorithms/scan", sums, [level.called("values"), *carry],
                  count=level.length + 1, defines={"FAN": FAN, "CARRY": bool(carry)},
                  elements=level.length)
        if carry:
            room.drop(*carry)
        carry = [sums.called("carry")]
    room.drop(*levels[1:])
    return sums
