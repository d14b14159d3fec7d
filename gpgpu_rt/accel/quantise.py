"""Conservative quantisation: stores boxes as small integers, rounded outwards."""
from __future__ import annotations

import numpy as np


def quantise(lo: np.ndarray, hi: np.ndarray, base: np.ndarray, top: np.ndarray,
             bits: int) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Quantise boxes to integers of ``bits`` bits; the decoded boxes contain the given boxes.

    The kernels decode a bound as ``base + q * quantum`` and round both operations to float32. If a
    decoded bound would lie inside the given box, the bound's q is moved outwards by 1.

    Parameters
    ----------
    lo, hi : (n, 3) float32, world units
    base, top : (3,) float32, corners of a box that contains all boxes

    Returns
    -------
    quantum : (3,) float32, the step along each axis, world units
    (q_lo, q_hi) : (n, 3) int64 each, the quantised lower and upper corners
    """
    base, top = np.asarray(base, np.float32), np.asarray(top, np.float32)
    most = (1 << bits) - 1
    quantum = ((top.astype(np.float64) - base) / most).astype(np.float32)
    while (short := decode(np.full(3, most), base, quantum) < top).any():
        quantum = np.where(short, np.nextafter(quantum, np.float32(np.inf)), quantum)
    step = np.where(quantum > 0, quantum, 1).astype(np.float64)
    q_lo = np.clip(np.floor((lo.astype(np.float64) - base) / step), 0, most).astype(np.int64)
    q_hi = np.clip(np.ceil((hi.astype(np.float64) - base) / step), 0, most).astype(np.int64)
    q_lo -= (decode(q_lo, base, quantum) > lo) & (q_lo > 0)
    q_hi += (decode(q_hi, base, quantum) < hi) & (q_hi < most)
    return quantum, (q_lo, q_hi)


def decode(q: np.ndarray, base: np.ndarray, quantum: np.ndarray) -> np.ndarray:
    """Return the bounds as the kernels decode them: float32, rounded after each operation."""
    return base + q.astype(np.float32) * quantum
