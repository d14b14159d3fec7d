"""Morton codes: interleave the bits of two or three coordinates; near points get near codes."""
from __future__ import annotations

import numpy as np

BITS = 21   # bits per axis; three axes fill 63 bits of an int64


def morton_2d(rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return (n,) int64 codes of integer coordinates below 2^31. From the highest bit down, bits
    of row and column alternate."""
    return _spread_by_two(rows) << 1 | _spread_by_two(columns)


def morton_3d(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return (n,) int64 codes of integer coordinates below 2^BITS. From the highest bit down, bits
    of x, y and z alternate."""
    return _spread_by_three(x) << 2 | _spread_by_three(y) << 1 | _spread_by_three(z)


def morton_order(points: np.ndarray) -> np.ndarray:
    """Return (n,) int64, the order of points (n, 3) along a Morton curve through their bounding
    cube. Points with equal codes keep their order."""
    if not len(points):
        return np.zeros(0, np.int64)
    points = points.astype(np.float64)
    points = points - points.min(axis=0)
    largest = points.max() or 1.0
    x, y, z = (points / largest * ((1 << BITS) - 1)).astype(np.int64).T
    return np.argsort(morton_3d(x, y, z), kind="stable")


def _spread_by_two(x: np.ndarray) -> np.ndarray:
    """Move bit i of each integer to bit 2 i."""
    x = x.astype(np.int64)
    for shift, mask in ((16, 0x0000ffff0000ffff), (8, 0x00ff00ff00ff00ff), (4, 0x0f0f0f0f0f0f0f0f),
                        (2, 0x3333333333333333), (1, 0x5555555555555555)):
        x = (x | x << shift) & mask
    return x


def _spread_by_three(x: np.ndarray) -> np.ndarray:
    """Move bit i of each integer to bit 3 i, for the lowest 21 bits."""
    for shift, mask in ((32, 0x001f00000000ffff), (16, 0x001f0000ff0000ff),
                        (8, 0x100f00f00f00f00f), (4, 0x10c30c30c30c30c3),
                        (2, 0x1249249249249249)):
        x = (x | x << shift) & mask
    return x
