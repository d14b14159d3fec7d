"""Statistics that say how evenly numbers are spread."""
from __future__ import annotations

import numpy as np


def chi_square(counts: np.ndarray) -> float:
    """Return how far the chi-square statistic of ``counts`` exceeds its mean, in standard
    deviations.

    The mean and the standard deviation assume that all cells are equally likely.
    """
    expected = counts.sum() / counts.size
    cells = counts.size - 1
    return float((((counts - expected) ** 2).sum() / expected - cells) / np.sqrt(2 * cells))


def box_counts(points: np.ndarray, halvings: tuple[int, ...]) -> np.ndarray:
    """Count the (n, d) points of the unit cube in each box.

    The boxes result from halving axis k of the cube ``halvings[k]`` times.
    """
    cells = np.zeros(len(points), int)
    for numbers, times in zip(points.T, halvings):
        cells = (cells << times) + (numbers * (1 << times)).astype(int)
    return np.bincount(cells, minlength=1 << sum(halvings))
