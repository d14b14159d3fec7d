"""Confidence bounds on the share of faults (wrong answers), from the number of faults in n rays
(Clopper and Pearson, 1934)."""
from __future__ import annotations

import math

import numpy as np

LEVEL = 0.95


def lower_confidence(faults: int, rays: int, confidence: float = LEVEL) -> float:
    """Return the lower confidence bound of the share of faults.

    If the true share equals this bound, the probability of ``faults`` or more faults in ``rays``
    rays is exactly 1 - confidence. Without faults, the bound is 0. `judge.upper_confidence` gives
    the upper bound.
    """
    if faults < 1:
        return 0.0
    k = np.arange(faults)           # sum the probabilities of fewer faults
    choices = np.concatenate(([0.0], np.cumsum(np.log((rays - k[1:] + 1) / k[1:]))))
    low, high = 0.0, faults / rays
    for _ in range(60):
        share = (low + high) / 2
        if share >= 1:
            break
        terms = choices + k * math.log(share) + (rays - k) * math.log1p(-share)
        most = terms.max()
        fewer = most + math.log(np.exp(terms - most).sum())
        low, high = (share, high) if fewer > math.log(confidence) else (low, share)
    return low


def rays_needed(share: float, confidence: float = LEVEL) -> int:
    """Return how many rays without a fault prove that the share of faults is below ``share``:
    about 3 / share."""
    return math.ceil(math.log1p(-confidence) / math.log1p(-share))
