"""Low-discrepancy numbers, bit-identical to ``glsl/render/sobol.glsl``, which names the papers."""
from __future__ import annotations

from typing import Any

import numpy as np

from .random_numbers import cell_middles, counters, random_bits

# A key selects a permutation. It is the hash of counters in which NO_SAMPLE replaces the sample's
# number, so all samples of a pixel have equal keys.
NO_SAMPLE = 0xFFFFFFFF
_MASKS = ((1, 0x55555555), (2, 0x33333333), (4, 0x0F0F0F0F), (8, 0x00FF00FF), (16, 0x0000FFFF))


def sobol_numbers(x: Any, y: Any, sample: Any, bounce: int, block: int, seed: int = 0
                  ) -> np.ndarray:
    """Return (n, 4) float64 numbers in (0, 1), multiples of 2^-24 as from `random_numbers`. The
    first two are for discrete choices, the last two for a position or direction.

    Parameters
    ----------
    x, y, sample : (n,) int each, or scalars: the pixel, and the number of the sample
    bounce : the vertex of the path, 0 for the eye
    block : 0 for the path's next direction, 1 for the choice of a light
    seed : each seed gives different numbers
    """
    return cell_middles(sobol_bits(x, y, sample, bounce, block, seed))


def sobol_bits(x: Any, y: Any, sample: Any, bounce: int, block: int, seed: int) -> np.ndarray:
    """Return (n, 4) uint32, the bits from which `sobol_numbers` makes its numbers."""
    if block not in (0, 1) or bounce < block:
        raise ValueError(f"bounce {bounce}, block {block}: give block 0, or 1 from bounce 1 on")

    def keys(event: int, number: int) -> np.ndarray:
        return random_bits(counters(x, y, NO_SAMPLE, event, number, seed))

    sample = np.atleast_1d(np.asarray(sample)).astype(np.uint32)
    pick_keys, place_keys = keys(bounce, 2 + block), keys(bounce - block, 4)
    pick = sobol_first_two(shuffled(sample, pick_keys[:, 0]))
    order = shuffled(sample, place_keys[:, 0])
    place = sobol_next_two(order) if block else sobol_first_two(order)
    if block:
        place_keys = keys(bounce - 1, 5)
    return np.stack(np.broadcast_arrays(
        *(reversed_bits(permuted(bits, some[:, k])) for points, some in ((pick, pick_keys),
                                                                         (place, place_keys))
          for k, bits in enumerate(points, 1))), axis=1)


def shuffled(sample: np.ndarray, key: np.ndarray) -> np.ndarray:
    """Return (n,) uint32, the number of the Sobol point that each sample uses. ``key`` selects the
    shuffled order."""
    low = reversed_bits(permuted(reversed_bits(sample), key)) & np.uint32(0xFFFF)
    return low | (sample & np.uint32(0xFFFF0000))


def permuted(x: np.ndarray, key: np.ndarray) -> np.ndarray:
    """Permute uint32 numbers. A bit of the result depends only on the same and lower bits of x."""
    with np.errstate(over="ignore"):
        x = x + key
        for factor in (0x6C50B47C, 0xB82F1E52, 0xC7AFE638, 0x8D22F6E6):
            x = x ^ x * np.uint32(factor)
    return x


def reversed_bits(x: np.ndarray) -> np.ndarray:
    """Return uint32 with the order of the bits reversed."""
    for shift, mask in _MASKS:
        by, low = np.uint32(shift), np.uint32(mask)
        x = ((x & low) << by) | ((x >> by) & low)
    return x


def sobol_first_two(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return coordinates 0 and 1 of Sobol points (n,): (n,) uint32 each, with reversed bits."""
    x = points
    for shift, mask in _MASKS:
        x = x ^ ((x >> np.uint32(shift)) & np.uint32(mask))
    return points, x


def sobol_next_two(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return coordinates 2 and 3 of Sobol points (n,): (n,) uint32 each, with reversed bits."""
    sums = np.zeros((2, *points.shape), np.uint32)
    second, third = [1, 3], [1, 3, 4]
    for bit in range(32):
        set_bits = (points >> np.uint32(bit)) & np.uint32(1)
        sums ^= set_bits * np.array([[second[0]], [third[0]]], np.uint32)
        second = [second[1], (second[1] ^ second[0] ^ second[0] << 2) & 0xFFFFFFFF]
        third = [*third[1:], (third[1] ^ third[0] ^ third[0] << 3) & 0xFFFFFFFF]
    return sums[0], sums[1]
