"""Kendall's tau-b: measures how well two orderings agree."""
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations


@dataclass(frozen=True)
class PairCounts:
    """Numbers of pairs of methods, by the order of their two times.

    Attributes
    ----------
    concordant : pairs in the same order in our times and in the published times
    discordant : pairs in reverse order
    only_ours : pairs that are ordered only in our times, and tie in the published times
    only_published : pairs that are ordered only in the published times
    """

    concordant: int
    discordant: int
    only_ours: int
    only_published: int

    @property
    def ordered(self) -> int:
        """The number of pairs whose published times do not tie."""
        return self.concordant + self.discordant + self.only_published

    @property
    def tau_b(self) -> float:
        """1 if the orderings are equal, -1 if reversed, nan if all pairs tie in an ordering."""
        both = self.concordant + self.discordant
        scale = math.sqrt((both + self.only_ours) * (both + self.only_published))
        return (self.concordant - self.discordant) / scale if scale else math.nan


def pair_counts(ours: Sequence[float], published: Sequence[float],
                tie: float = 0.05) -> PairCounts:
    """Compare the orders of two lists of times, pair by pair.

    Parameters
    ----------
    ours, published : times of the same methods
    tie : two published times tie if they differ by at most this share of the larger time
    """
    concordant = discordant = only_ours = only_published = 0
    for i, j in combinations(range(len(ours)), 2):
        a = (ours[i] > ours[j]) - (ours[i] < ours[j])
        b = (published[i] > published[j]) - (published[i] < published[j])
        if abs(published[i] - published[j]) <= tie * max(published[i], published[j]):
            b = 0
        concordant += a * b > 0
        discordant += a * b < 0
        only_ours += a != 0 and b == 0
        only_published += a == 0 and b != 0
    return PairCounts(concordant, discordant, only_ours, only_published)


def tau_b(ours: Sequence[float], published: Sequence[float], tie: float = 0.05) -> float:
    """Return `PairCounts.tau_b`; the parameters are those of `pair_counts`."""
    return pair_counts(ours, published, tie).tau_b
