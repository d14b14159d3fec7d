"""Sort: sorts a stream of keys in ascending order, by bitonic merges."""
from __future__ import annotations

from .records import SORT_KEY
from .streams import Stream, StreamRoom


def sort(room: StreamRoom, keys: Stream) -> Stream:
    """Return the keys (SORT_KEY) in the order of hi, lo and index, for any number of keys.

    The sort is stable if indices ascend. For n keys and k = ceil(log2 n), the sort has
    k (k + 1) / 2 steps, two per pass. Passes draw alternately into ``keys`` and another stream; at
    the end, the stream without the result is dropped.
    """
    now, spare = keys, room.stream(SORT_KEY, keys.length)
    steps = flips(keys.length)
    for pair in zip(steps[::2], [*steps[1::2], 0]):
        room.draw("algorithms/sort", spare, [now], flips=pair, elements=keys.length)
        now, spare = spare, now
    room.drop(spare)
    return now


def flips(length: int) -> list[int]:
    """Return an integer for each step: the exclusive or of the indices of two compared
    elements."""
    merged, result = 1, []
    while merged < length:
        result.append(2 * merged - 1)          # compare mirror images in two sorted halves
        distance = merged >> 1
        while distance:
            result.append(distance)
            distance >>= 1
        merged *= 2
    return result
