"""Reduction, scan, stream reduction and sort are exact for any pattern and any length."""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.gl.algorithms.compact import compact
from gpgpu_rt.gl.algorithms.records import SORT_KEY, VALUES
from gpgpu_rt.gl.algorithms.reduce import OPERATIONS, reduce_stream
from gpgpu_rt.gl.algorithms.scan import scan
from gpgpu_rt.gl.algorithms.sort import flips, sort
from gpgpu_rt.gl.algorithms.streams import Stream, StreamRoom, span

# A single element; full blocks and full texture rows; one element fewer or more; several rows.
LENGTHS = (1, 2, 7, 8, 9, 64, 65, 100, 4095, 4096, 4097, 8192, 20_001)
some_lengths = pytest.mark.parametrize("length", LENGTHS)


def patterns(length: int, seed: int) -> np.ndarray:
    """Return (length, 4) flags. The four columns flag no element, all elements, every third
    element and random elements."""
    flags = np.zeros((length, 4), np.float32)
    flags[:, 1], flags[::3, 2] = 1, 1
    flags[:, 3] = np.random.default_rng(seed).random(length) < 0.3
    return flags


@some_lengths
@pytest.mark.parametrize("operation", OPERATIONS)
def test_reduction(gpu, operation: str, length: int) -> None:
    values = np.random.default_rng(length).integers(-500, 500, (length, 4))
    with StreamRoom(gpu) as room:
        result = reduce_stream(room, room.stream(VALUES, length, value=values), operation)
        assert result.length == 1
        assert (result.read()["value"] == getattr(np, operation)(values, axis=0)).all()


@pytest.mark.parametrize("length", (0, *LENGTHS))
def test_scan(gpu, length: int) -> None:
    values = patterns(length, 1) * [1, 1, 700, 5]
    with StreamRoom(gpu) as room:
        sums = scan(room, room.stream(VALUES, length, value=values)).read()["value"]
    assert (sums == np.vstack([np.zeros((1, 4)), np.cumsum(values, axis=0)])).all()


@pytest.mark.parametrize("length", (0, *LENGTHS))
@pytest.mark.parametrize("pattern", range(4))
def test_stream_reduction_keeps_order(gpu, pattern: int, length: int) -> None:
    flags = patterns(length, 2)[:, pattern]
    items = np.random.default_rng(3).permutation(length)
    with StreamRoom(gpu) as room:
        kept = compact(room, room.stream(SORT_KEY, length, hi=items, index=np.arange(length)),
                       room.stream(VALUES, length, value=np.repeat(flags[:, None], 4, 1)))
        found = kept.read()
    assert (found["hi"] == items[flags > 0]).all()
    assert (found["index"] == np.flatnonzero(flags)).all()


@pytest.mark.parametrize("keys", ["distinct", "few", "equal", "ascending", "descending", "low"])
@pytest.mark.parametrize("length", (0, *LENGTHS))
def test_sort(gpu, keys: str, length: int) -> None:
    rng = np.random.default_rng(length)
    hi, lo = (rng.integers(1 << 15, size=length) for _ in range(2))
    if keys == "few":
        hi, lo = hi % 3, lo % 2
    elif keys == "low":
        hi[:] = 5
    elif keys != "distinct":
        hi[:] = 9
        lo = {"equal": lo * 0, "ascending": np.sort(lo), "descending": np.sort(lo)[::-1]}[keys]
    order = np.lexsort([lo, hi])       # a stable sort
    with StreamRoom(gpu) as room:
        found = sort(room, room.stream(SORT_KEY, length, hi=hi, lo=lo,
                                       index=np.arange(length))).read()
    assert (found["index"] == order).all()
    assert (found["hi"] == hi[order]).all() and (found["lo"] == lo[order]).all()


@pytest.mark.parametrize("length", range(34))
def test_sort_puts_zeros_before_ones(length: int) -> None:
    """A network of comparisons that sorts all words of zeros and ones sorts any input.

    The test sorts the words of ``length`` digits in which all ones precede all zeros, and 500
    random words.
    """
    rng = np.random.default_rng(length)
    words = np.concatenate([np.tri(length + 1, length, -1), rng.random((500, length)) < 0.5])
    places = np.arange(length)
    for flip in flips(length):
        partner = places ^ flip
        inside = partner < length
        other = words[:, np.where(inside, partner, places)]
        words = np.where(partner > places, np.minimum(words, other), np.maximum(words, other))
    assert (np.diff(words, axis=1) >= 0).all()


@pytest.mark.parametrize("first, count", [(0, 1), (0, 4096), (5, 4091), (4095, 2), (7, 12_000),
                                          (4096, 4096), (4095, 4097), (3, 0)])
def test_spans_cover_every_element_once(first: int, count: int) -> None:
    covered = np.zeros((6, 4096), int)
    for x0, y0, x1, y1 in span(first, count).astype(int):
        covered[y0:y1, x0:x1] += 1
    assert (np.flatnonzero(covered) == np.arange(first, first + count)).all()
    assert covered.max() <= 1


def test_one_element_alone_is_read(gpu) -> None:
    values = np.arange(4 * 5000).reshape(-1, 4)
    with StreamRoom(gpu) as room:
        stream: Stream = room.stream(VALUES, 5000, value=values)
        assert (stream.read_one(4097)["value"] == values[4097]).all()


def test_a_stream_of_more_than_2_24_elements_is_refused(gpu) -> None:
    with StreamRoom(gpu) as room, pytest.raises(rt.LimitError, match="2\\^24") as refusal:
        room.stream(VALUES, (1 << 24) + 2)
    assert "\n" not in str(refusal.value)


def test_reading_a_stream_that_is_drawn_into_is_refused(gpu) -> None:
    with StreamRoom(gpu) as room:
        values = room.stream(VALUES, 10, value=np.zeros((10, 4)))
        with pytest.raises(rt.Error, match="draw"):
            room.draw("algorithms/scan", values.called("sums"),
                      [values], defines={"FAN": 8}, elements=9)
