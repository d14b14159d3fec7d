"""Draws: makes random numbers with the same bits on every machine.

These functions use only operations whose results are defined to the bit: integer operations, +, -,
*, /, square roots, minima, maxima and scaling by powers of two. Each operation has its own numpy
call, so no compiler can fuse a multiplication with an addition. Sines, powers, normal
distributions, matrix products and norms are not used: their results differ between libraries.
"""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

Shape = int | tuple[int, ...]


def between(rng: np.random.Generator, low: float, high: float, shape: Shape) -> np.ndarray:
    """Return float64 of this shape, uniform in [low, high)."""
    return low + (high - low) * rng.random(shape)


def bell(rng: np.random.Generator, shape: Shape) -> np.ndarray:
    """Return float64 of this shape with mean 0 and variance 1, as sums of uniform numbers."""
    total = between(rng, -1, 1, shape)
    for _ in range(3):
        total = total + between(rng, -1, 1, shape)
    return total * 0.8660254037844386


def directions(rng: np.random.Generator, n: int) -> np.ndarray:
    """Return (n, 3) float64 unit vectors, denser towards the corners of a cube."""
    return unit(between(rng, -1, 1, (n, 3)) + 2.0 ** -60)


def unit(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (..., 3) divided by their lengths."""
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return vectors / np.sqrt(x * x + y * y + z * z)[..., None]


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the cross products of vectors (..., 3)."""
    return np.stack([a[..., (i + 1) % 3] * b[..., (i + 2) % 3]
                     - a[..., (i + 2) % 3] * b[..., (i + 1) % 3] for i in range(3)], -1)


def binades(rng: np.random.Generator, low: float, high: float, shape: Shape) -> np.ndarray:
    """Return float64 of this shape in [2^a, 2^b), where 2^a and 2^b are the next powers of two
    above ``low`` and ``high``. All binades [2^k, 2^(k + 1)) are equally probable."""
    first, last = np.frexp(low)[1], np.frexp(high)[1]
    return np.ldexp(1 + rng.random(shape), rng.integers(first, last, shape))


def chosen(rng: np.random.Generator, values: Sequence[float] | np.ndarray,
           shape: Shape) -> np.ndarray:
    return np.asarray(values)[rng.integers(len(values), size=shape)]


def spread_over(rng: np.random.Generator, shape: Shape) -> np.ndarray:
    """Return (*shape, 3) float64 barycentric coordinates, uniform over a triangle."""
    first, second = rng.random(shape), rng.random(shape)
    low, high = np.minimum(first, second), np.maximum(first, second)
    return np.stack([low, high - low, 1 - high], -1)
