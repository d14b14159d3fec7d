"""Sort: a stream of keys in ascending order, by bitonic merges."""
from __future__ import annotations

from .records import SORT_KEY
from .streams import Stream, StreamRoom


def sort(room: StreamRoom, keys: Stream) -> Stream:
    """The keys, SORT_KEY, by hi, lo and index; any number of them.

    Equal keys come in the order of their index, so where indices ascend the sort is stable. For n
    keys it takes k (k + 1) / 2 steps, k = ceil(log2 n), two a pass. Both ``keys`` and another
    stream are drawn into; the one that is returned holds the result and the other one is dropped.
    """
    now, spare = keys, room.stream(SORT_KEY, keys.length)
    steps = flips(keys.length)
    for pair in zip(steps[::2], [*steps[1::2], 0]):
        room.draw("algorithms/sort", spare, [now], flips=pair, elements=keys.length)
        now, spare = spare, now
    room.drop(spare)
    return now


def flips(length: int) -> list[int]:
    """The bits in which the number of each element's partner differs, step by step."""
    merged, result = 1, []
    while merged < length:
        result.append(2 * merged - 1)          # mirror a block of two sorted halves
        distance = merged >> 1
        while distance:
            result.append(distance)
            distance >>= 1
        merged *= 2
    return result
