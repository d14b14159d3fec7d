"""A software cache in a processor's own memory, as Benthin et al. (2006) kept on the Cell: what a
run of fetches finds there, and what it must have transferred.

The cache is direct-mapped, a line of memory in the one place that its number says. Rays are
served one after another, each in the order of its own fetches.
"""
from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

LINE = 128    # bytes, what one transfer moves


@dataclass
class Fetches:
    """Looks at an emulation and keeps which lines of tables each fragment fetches, in order."""

    texel_bytes: int = 16
    _lines: list[np.ndarray] = field(default_factory=list)
    _rays: list[np.ndarray] = field(default_factory=list)
    _tables: dict[str, int] = field(default_factory=dict)

    def __call__(self, sampler: str, at: np.ndarray, mask: np.ndarray) -> None:
        if not sampler.endswith("_table"):
            return
        table = self._tables.setdefault(sampler, len(self._tables) + 1)
        rays = np.flatnonzero(mask)
        self._rays.append(rays)
        self._lines.append((table << 40) + np.broadcast_to(at, mask.shape)[rays].astype(
            np.int64) * self.texel_bytes // LINE)

    def in_order(self) -> np.ndarray:
        """(fetches,) int64: lines, ray after ray."""
        if not self._lines:
            return np.zeros(0, np.int64)
        rays = np.concatenate(self._rays)
        return np.concatenate(self._lines)[np.argsort(rays, kind="stable")]


def transfers(lines: np.ndarray, size: int) -> int:
    """How many of these fetches miss a cache of ``size`` bytes that holds nothing before.

    Parameters
    ----------
    lines : (fetches,) int64, in their order
    """
    places = max(1, size // LINE)
    # Tables are spread over the places, as they would follow each other in memory.
    place = (lines + (lines >> 40) * 7919) % places
    order = np.argsort(place, kind="stable")
    line, where = lines[order], place[order]
    same = (line[1:] == line[:-1]) & (where[1:] == where[:-1])
    return int(len(lines) - np.count_nonzero(same))
