"""Random numbers without a state: the twin of ``glsl/render/random.glsl``, the same bits."""
from __future__ import annotations

from typing import Any

import numpy as np

MOST_BOUNCES, MOST_SEEDS, BLOCKS = 1 << 12, 1 << 16, 1 << 4


def random_numbers(x: Any, y: Any, sample: Any, bounce: int, block: int, seed: int = 0
                   ) -> np.ndarray:
    """(n, 4) float64 in (0, 1), multiples of 2^-24: what float32 holds exactly.

    Parameters
    ----------
    x, y, sample : (n,) int each, or scalars: the pixel, and which of its samples
    bounce, block : which of the path's events, and which four of its numbers
    seed : another one gives other numbers everywhere
    """
    return cell_middles(random_bits(counters(x, y, sample, bounce, block, seed)))


def counters(x: Any, y: Any, sample: Any, bounce: int, block: int, seed: int) -> np.ndarray:
    """(n, 4) uint32: what numbers are hashed from; all different."""
    for value, most in ((bounce, MOST_BOUNCES), (block, BLOCKS), (seed, MOST_SEEDS)):
        if not 0 <= value < most:
            raise ValueError(f"bounce {bounce}, block {block}, seed {seed}: each must be below "
                             f"{MOST_BOUNCES}, {BLOCKS}, {MOST_SEEDS}")
    which = np.uint32(seed << 16 | bounce << 4 | block)
    return np.stack(np.broadcast_arrays(*(np.atleast_1d(np.asarray(a)).astype(np.uint32)
                                          for a in (x, y, sample, which))), axis=1)


def cell_middles(bits: np.ndarray) -> np.ndarray:
    """Numbers in (0, 1) from uint32: the middles of 2^23 cells."""
    return ((bits >> np.uint32(9)) + 0.5) * 2.0 ** -23


def random_bits(counters: np.ndarray) -> np.ndarray:
    """(n, 4) uint32 from as many: pcg4d of Jarzynski and Olano 2020, one to one."""
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
