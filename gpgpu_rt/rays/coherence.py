"""Coherence: measures how similar neighbouring rays are, on a sample of tiles."""
from __future__ import annotations

import numpy as np

from .batch import RayBatch

TILE = 8          # side of a tile in rays
SAMPLE = 256      # largest number of tiles in the sample, evenly distributed
NEAR = 1 / 16     # origins closer than this share of the scene's diagonal count as near


def coherence(batch: RayBatch, diagonal: float) -> float | None:
    """Return the share of neighbouring rays that are similar.

    Two neighbours in a tile are similar if their directions have the same signs and the same
    dominant axis, and if their origins are near each other.

    Parameters
    ----------
    batch : the rays; rays with an empty interval are ignored
    diagonal : the diagonal of the scene's box, world units

    Returns
    -------
    float
        from 0 to 1; None if no pair of neighbouring rays exists
    """
    rays = batch.sample(*_sampled(*batch.size[::-1]))    # each field: (tiles, y, x, ...)
    origins, directions = rays["origin"], rays["direction"]
    usable = rays["t_min"] <= rays["t_max"]
    kind = (directions < 0) @ np.array([1, 2, 4]) + 8 * np.abs(directions).argmax(-1)
    alike = pairs = 0
    for one, other in ((np.s_[:, :, :-1], np.s_[:, :, 1:]), (np.s_[:, :-1], np.s_[:, 1:])):
        both = usable[one] & usable[other]
        with np.errstate(over="ignore"):
            near = np.abs(origins[one] - origins[other]).max(-1) <= NEAR * diagonal
        pairs += int(both.sum())
        alike += int((both & near & (kind[one] == kind[other])).sum())
    return alike / pairs if pairs else None


def _sampled(height: int, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows (tiles, y, 1) and columns (tiles, 1, x) of a sample of complete tiles."""
    y, x = min(TILE, height), min(TILE, width)
    down, across = (height // y, width // x) if y and x else (0, 0)
    tiles = np.unique(np.linspace(0, max(down * across - 1, 0), min(SAMPLE, down * across))
                      .astype(np.int64))
    row, column = np.divmod(tiles, max(across, 1))
    return (row[:, None] * y + np.arange(y))[:, :, None], (
        column[:, None] * x + np.arange(x))[:, None, :]
