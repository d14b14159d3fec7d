"""Scan: the sums of all elements before each, which stream reduction and partition begin with."""
from __future__ import annotations

from .records import VALUES
from .reduce import FAN, reduce_once
from .streams import Stream, StreamRoom


def scan(room: StreamRoom, values: Stream) -> Stream:
    """Exclusive prefix sums: n + 1 elements called "sums", the last of them the total.

    Parameters
    ----------
    values : n elements of the record VALUES; four channels are summed apart

    Exact while sums are integers up to 2^24: blocks are added up level by level on the way up, and
    on the way down each level takes what stands before its block from the level above (G.
    Blelloch, "Prefix Sums and Their Applications", 1990).
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
