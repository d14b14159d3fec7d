"""A simulated software cache in a processor's local store, as Benthin et al. (2006) had on the
Cell.

The cache is direct-mapped. Groups of rays are simulated one after another, each with its fetches
in order. A line that several rays of a group fetch together is transferred once.
"""
from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass
class Fetches:
    """Records the table addresses that each fragment of an emulation fetches, in order."""

    texel_bytes: int = 16
    _places: list[np.ndarray] = field(default_factory=list)
    _rays: list[np.ndarray] = field(default_factory=list)
    _tables: dict[str, int] = field(default_factory=dict)

    def __call__(self, sampler: str, at: np.ndarray, mask: np.ndarray) -> None:
        if not sampler.endswith("_table"):
            return
        table = self._tables.setdefault(sampler, len(self._tables) + 1)
        rays = np.flatnonzero(mask)
        self._rays.append(rays)
        self._places.append((table << 40) + np.broadcast_to(at, mask.shape)[rays].astype(
            np.int64) * self.texel_bytes)

    def in_order(self, line: int, together: int = 1) -> np.ndarray:
        """Return the fetched lines of ``line`` bytes, (fetches,) int64, group after group of
        ``together`` rays."""
        if not self._places:
            return np.zeros(0, np.int64)
        groups = np.concatenate(self._rays) // together
        places = np.concatenate(self._places)[np.argsort(groups, kind="stable")]
        table = places >> 40
        return (table << 40) + (places - (table << 40)) // line


def transfers(lines: np.ndarray, places: int) -> int:
    """Return how many fetches miss an initially empty cache.

    Parameters
    ----------
    lines : (fetches,) int64, the fetched lines in order
    places : number of lines that the cache holds
    """
    # Give each table a different offset. Without it, all tables would begin at the same cache
    # line, which they would not do in memory.
    place = (lines + (lines >> 40) * 7919) % places
    order = np.argsort(place, kind="stable")
    line, where = lines[order], place[order]
    same = (line[1:] == line[:-1]) & (where[1:] == where[:-1])
    return int(len(lines) - np.count_nonzero(same))
