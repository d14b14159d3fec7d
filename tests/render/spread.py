"""How evenly numbers are spread."""
from __future__ import annotations

import numpy as np


def chi_square(counts: np.ndarray) -> float:
    """How many standard deviations counts of equally likely cells lie off their spread."""
    expected = counts.sum() / counts.size
    cells = counts.size - 1
    return float((((counts - expected) ** 2).sum() / expected - cells) / np.sqrt(2 * cells))


def box_counts(points: np.ndarray, halvings: tuple[int, ...]) -> np.ndarray:
    """How many of (n, d) points in the unit cube lie in each box, where the k-th axis is halved
    ``halvings[k]`` times."""
    cells = np.zeros(len(points), int)
    for numbers, times in zip(points.T, halvings):
        cells = (cells << times) + (numbers * (1 << times)).astype(int)
    return np.bincount(cells, minlength=1 << sum(halvings))
