"""Kendall's tau-b: how well two orderings agree."""
from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations


def tau_b(ours: Sequence[float], published: Sequence[float], tie: float = 0.05) -> float:
    """Agreement of two orderings: 1 if equal, -1 if reversed, nan if either orders nothing.

    Parameters
    ----------
    ours, published : times of the same methods
    tie : published times this close, relative to the larger one, count as equal
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
    pairs = concordant + discordant
    scale = math.sqrt((pairs + only_ours) * (pairs + only_published))
    return (concordant - discordant) / scale if scale else math.nan
