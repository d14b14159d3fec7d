"""A software cache in a processor's own memory, as Benthin et al. (2006) kept on the Cell: what a
run of fetches finds there, and what it must have transferred.

The cache is direct-mapped, a line of memory in the one place that its number says. Groups of rays
are served one after another, each in the order of its own fetches; what a group's rays fetch
together is transferred once.
"""
from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass
class Fetches:
    """Looks at an emulation and keeps where in tables each fragment fetches, in order."""

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
        """(fetches,) int64: lines of so many bytes, group after group of so many rays."""
        if not self._places:
            return np.zeros(0, np.int64)
        groups = np.concatenate(self._rays) // together
        places = np.concatenate(self._places)[np.argsort(groups, kind="stable")]
        table = places >> 40
        return (table << 40) + (places - (table << 40)) // line


def transfers(lines: np.ndarray, places: int) -> int:
    """How many of these fetches miss a cache that has places for so many lines, all empty before.

    Parameters
    ----------
    lines : (fetches,) int64, in their order
    """
    # Tables are spread over the places, as they would follow each other in memory.
    place = (lines + (lines >> 40) * 7919) % places
    order = np.argsort(place, kind="stable")
    line, where = lines[order], place[order]
    same = (line[1:] == line[:-1]) & (where[1:] == where[:-1])
    return int(len(lines) - np.count_nonzero(same))
