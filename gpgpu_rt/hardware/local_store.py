"""Local store: simulates a software cache, as Benthin et al. (2006) used it on the Cell.

The cache is direct-mapped. Groups of rays are simulated one after another. The reads of a group
keep their order. A line that several rays of a group fetch together is transferred once.
"""
from __future__ import annotations

import numpy as np

from .table_reads import TABLE


def lines_of(places: np.ndarray, line: int) -> np.ndarray:
    """Return the number of the cache line that each read needs, (reads,) int64. ``places`` comes
    from `table_reads`. A line has ``line`` bytes. The first line of table k has the number
    k * TABLE."""
    table = places // TABLE * TABLE
    return table + (places - table) // line


def transfers(lines: np.ndarray, places: int) -> int:
    """Return how many fetches miss an initially empty cache.

    Parameters
    ----------
    lines : (fetches,) int64, the fetched lines in order
    places : number of lines that the cache holds
    """
    # Offset the tables, because in memory they begin at different cache lines.
    place = (lines + (lines // TABLE) * 7919) % places
    order = np.argsort(place, kind="stable")
    line, where = lines[order], place[order]
    same = (line[1:] == line[:-1]) & (where[1:] == where[:-1])
    return int(len(lines) - np.count_nonzero(same))
