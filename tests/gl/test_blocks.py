"""Stream reduction by blocks is exact for any pattern and any length, across texel rows."""
from __future__ import annotations

import numpy as np
import pytest

from gpgpu_rt.gl.algorithms.blocks import BLOCK, reduce_by_blocks, reduce_children
from gpgpu_rt.gl.algorithms.records import SORT_KEY, VALUES
from gpgpu_rt.gl.algorithms.streams import StreamRoom
from gpgpu_rt.methods.ray_hierarchy.records import CHILDREN, PAIR

BLOCKED = 4 * BLOCK
# 0 and 1 elements; full texels, blocks and texture rows; one element fewer or more; several rows.
LENGTHS = (0, 1, 3, 4, 5, BLOCKED - 1, BLOCKED, BLOCKED + 1, 4095, 4096, 4097, 16_384, 16_385,
           70_001)
PATTERNS = ("none", "all", "first", "last", "thirds", "blocks", "sparse", "half", "dense")
SEED = 7


def pattern(name: str, length: int, seed: int) -> np.ndarray:
    """Return (length,) bool: the elements to keep."""
    at, rng = np.arange(length), np.random.default_rng(seed)
    return {"none": at < 0, "all": at >= 0, "first": at == 0, "last": at == length - 1,
            "thirds": at % 3 == 0, "blocks": at // BLOCKED % 2 == 1,
            "sparse": rng.random(length) < 0.01, "half": rng.random(length) < 0.5,
            "dense": rng.random(length) < 0.99}[name]


@pytest.mark.parametrize("seed", [SEED], ids="seed{}".format)
@pytest.mark.parametrize("name", PATTERNS)
def test_kept_elements_stay_in_order(gpu, name: str, seed: int) -> None:
    for length in LENGTHS:
        kept = pattern(name, length, seed)
        items = np.random.default_rng(seed).permutation(length)
        with StreamRoom(gpu) as room:
            found = reduce_by_blocks(
                room, room.stream(SORT_KEY, length, hi=items, index=np.arange(length)),
                room.stream(VALUES, length, value=np.repeat(kept[:, None], 4, 1))).read()
        assert (found["hi"] == items[kept]).all(), length
        assert (found["index"] == np.flatnonzero(kept)).all(), length


@pytest.mark.parametrize("seed", range(20), ids="seed{}".format)
def test_rows_end_anywhere_in_a_block(gpu, seed: int) -> None:
    """The share of kept elements varies along the stream, so blocks keep different numbers of
    elements. The kept elements of a block end before, at or after the end of a texture row."""
    rng = np.random.default_rng(seed)
    length = int(rng.integers(9_000, 30_000))
    kept = rng.random(length) < np.repeat(rng.random(length // 50 + 1), 50)[:length]
    with StreamRoom(gpu) as room:
        found = reduce_by_blocks(room, room.stream(VALUES, length, value=np.repeat(
            np.arange(length)[:, None], 4, 1)), room.stream(VALUES, length, value=np.repeat(
                kept[:, None], 4, 1))).read()
    assert (found["value"][:, 2] == np.flatnonzero(kept)).all()


@pytest.mark.parametrize("seed", [SEED], ids="seed{}".format)
@pytest.mark.parametrize("count", [1, 15, 16, 17, 1024, 5000])
def test_four_targets_become_one_stream(gpu, count: int, seed: int) -> None:
    """`reduce_children` packs the used slots of four render targets into one stream, in order."""
    rng = np.random.default_rng(seed)
    slots = rng.integers(0, 1000, (count, 4, 3))
    slots[rng.random((count, 4)) < 0.6] = -1
    names = [field.name for field in CHILDREN.fields]
    with StreamRoom(gpu) as room:
        children = room.stream(CHILDREN, count + 9, **{
            name: np.concatenate([slots[:, k], np.zeros((9, 3))]) for k, name in enumerate(names)})
        pairs, kept = reduce_children(room, children, count, PAIR)
        found = pairs.read(kept)
    expected = slots.reshape(-1, 3)
    expected = expected[expected[:, 0] >= 0]
    assert kept == len(expected) and pairs.length >= kept
    assert (np.column_stack([found[name] for name in "triangle x y".split()]) == expected).all()
