"""Runs: a flat array holds the items of several owners, such as the triangles of all leaves.

The items of an owner are side by side and form a run, which has a start and a count.
"""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

SHORT_AT_ONCE = 1 << 12     # short runs per group; a larger group would not fit in the cache


def run_starts(counts: np.ndarray) -> np.ndarray:
    """Return (k,) int64, the start of each run when runs of these lengths are concatenated."""
    return np.cumsum(counts, dtype=np.int64) - counts


def expand(starts: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return the indices start, start + 1, ... of all runs, concatenated, int64."""
    shift = np.repeat(starts - run_starts(counts), counts)
    return shift + np.arange(len(shift), dtype=np.int64)


def owners(counts: np.ndarray) -> np.ndarray:
    """Return the run number of each item of concatenated runs, int64."""
    return np.repeat(np.arange(len(counts)), counts)


def chunks(counts: np.ndarray, limit: int) -> list[slice]:
    """Return slices of the runs, each with at most `limit` items, or with a single longer run."""
    ends = np.cumsum(counts, dtype=np.int64)
    result, begin, done = [], 0, 0
    while begin < len(counts):
        end = max(int(np.searchsorted(ends, done + limit, side="right")), begin + 1)
        result.append(slice(begin, end))
        begin, done = end, int(ends[end - 1])
    return result


def of_like_length(counts: np.ndarray, lengths: Sequence[int],
                   above: int) -> list[tuple[np.ndarray, int]]:
    """Group runs of similar length: return pairs (run numbers, length limit of the group).

    Runs of at most ``above`` items and runs longer than the last of ``lengths`` are in no group.

    Parameters
    ----------
    lengths : the length limits of the groups, ascending
    """
    found: list[tuple[np.ndarray, int]] = []
    for length in lengths:
        some = np.flatnonzero((counts > above) & (counts <= length))
        found += [(some[begin:begin + SHORT_AT_ONCE], length)
                  for begin in range(0, len(some), SHORT_AT_ONCE)]
        above = length
    return found
