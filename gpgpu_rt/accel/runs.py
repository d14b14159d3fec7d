"""Runs: consecutive items of one owner in a flat array, given by start and count."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

SHORT_AT_ONCE = 1 << 12     # short runs worked on together, so that they stay in the cache


def run_starts(counts: np.ndarray) -> np.ndarray:
    """Where each run begins when runs of these lengths follow one another: (k,) int64."""
    return np.cumsum(counts, dtype=np.int64) - counts


def expand(starts: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """The indices start, start + 1, ... of all runs after one another, int64."""
    shift = np.repeat(starts - run_starts(counts), counts)
    return shift + np.arange(len(shift), dtype=np.int64)


def owners(counts: np.ndarray) -> np.ndarray:
    """For each item of runs that follow one another: the number of its run, int64."""
    return np.repeat(np.arange(len(counts)), counts)


def chunks(counts: np.ndarray, limit: int) -> list[slice]:
    """Slices over the runs, each with at most `limit` items (or with one longer run)."""
    ends = np.cumsum(counts, dtype=np.int64)
    result, begin, done = [], 0, 0
    while begin < len(counts):
        end = max(int(np.searchsorted(ends, done + limit, side="right")), begin + 1)
        result.append(slice(begin, end))
        begin, done = end, int(ends[end - 1])
    return result


def of_like_length(counts: np.ndarray, lengths: Sequence[int],
                   above: int) -> list[tuple[np.ndarray, int]]:
    """The runs longer than ``above``, those of a like length together: (their numbers, the length
    that none is past). Longer ones than the last length are left out.

    Parameters
    ----------
    lengths : ascending
    """
    found: list[tuple[np.ndarray, int]] = []
    for length in lengths:
        some = np.flatnonzero((counts > above) & (counts <= length))
        found += [(some[begin:begin + SHORT_AT_ONCE], length)
                  for begin in range(0, len(some), SHORT_AT_ONCE)]
        above = length
    return found
