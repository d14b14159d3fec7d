"""Random numbers without a state, bit-identical to ``glsl/render/random.glsl``."""
from __future__ import annotations

from typing import Any

import numpy as np

MOST_BOUNCES, MOST_SEEDS, BLOCKS = 1 << 12, 1 << 16, 1 << 4


def random_numbers(x: Any, y: Any, sample: Any, bounce: int, block: int, seed: int = 0
                   ) -> np.ndarray:
    """Return (n, 4) float64 in (0, 1), multiples of 2^-24, which float32 represents exactly.

    Parameters
    ----------
    x, y, sample : (n,) int each, or scalars: the pixel, and the number of the sample
    bounce : the vertex of the path, 0 for the eye
    block : the group of four random numbers at this vertex
    seed : each seed gives different numbers
    """
    return cell_middles(random_bits(counters(x, y, sample, bounce, block, seed)))


def counters(x: Any, y: Any, sample: Any, bounce: int, block: int, seed: int) -> np.ndarray:
    """Return (n, 4) uint32 counters, which are hashed to random numbers. Different arguments give
    different counters."""
    for value, most in ((bounce, MOST_BOUNCES), (block, BLOCKS), (seed, MOST_SEEDS)):
        if not 0 <= value < most:
            raise ValueError(f"bounce {bounce}, block {block}, seed {seed}: each must be below "
                             f"{MOST_BOUNCES}, {BLOCKS}, {MOST_SEEDS}")
    which = np.uint32(seed << 16 | bounce << 4 | block)
    return np.stack(np.broadcast_arrays(*(np.atleast_1d(np.asarray(a)).astype(np.uint32)
                                          for a in (x, y, sample, which))), axis=1)


def cell_middles(bits: np.ndarray) -> np.ndarray:
    """Map uint32 to numbers in (0, 1): the centres of 2^23 equal cells."""
    return ((bits >> np.uint32(9)) + 0.5) * 2.0 ** -23


def random_bits(counters: np.ndarray) -> np.ndarray:
    """Hash (n, 4) uint32 to (n, 4) uint32 by pcg4d (Jarzynski and Olano 2020), a bijection."""
    with np.errstate(over="ignore"):
        x, y, z, w = (counters.astype(np.uint32) * np.uint32(1664525)
                      + np.uint32(1013904223)).T
        x = x + y * w
        y = y + z * x
        z = z + x * y
        w = w + y * z
        x, y, z, w = (a ^ (a >> np.uint32(16)) for a in (x, y, z, w))
        x = x + y * w
        y = y + z * x
        z = z + x * y
        w = w + y * z
    return np.stack([x, y, z, w], axis=1)
