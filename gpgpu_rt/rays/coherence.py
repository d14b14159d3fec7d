"""Coherence: how much alike neighbouring rays are, from a sample of their tiles."""
from __future__ import annotations

import numpy as np

from .batch import RayBatch

TILE = 8          # rays a side
SAMPLE = 256      # tiles looked at, evenly spread
NEAR = 1 / 16     # of the scene's diagonal, within which origins of neighbours lie


def coherence(batch: RayBatch, diagonal: float) -> float | None:
    """The share of neighbouring rays that are alike.

    Two rays next to each other in a tile are alike where their directions have the same signs and
    the same dominant axis, and their origins are near for a scene of this size: they then visit
    much the same nodes in the same order, and test triangles along the same axis.

    Parameters
    ----------
    batch : the rays; one whose interval is empty says nothing of its neighbours
    diagonal : of the scene's box, world units

    Returns
    -------
    float
        from 0 to 1; None where no two rays lie side by side
    """
    rays = batch.sample(*_sampled(*batch.size[::-1]))    # (tiles, y, x) each
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
    """Rows (tiles, y, 1) and columns (tiles, 1, x) of a sample of the whole tiles; smaller ones
    where the rays fill none."""
    y, x = min(TILE, height), min(TILE, width)
    down, across = (height // y, width // x) if y and x else (0, 0)
    tiles = np.unique(np.linspace(0, max(down * across - 1, 0), min(SAMPLE, down * across))
                      .astype(np.int64))
    row, column = np.divmod(tiles, max(across, 1))
    return (row[:, None] * y + np.arange(y))[:, :, None], (
        column[:, None] * x + np.arange(x))[:, None, :]
