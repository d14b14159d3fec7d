"""Confidence: what k faults among n rays prove of the share of faults (Clopper and Pearson)."""
from __future__ import annotations

import math

import numpy as np

LEVEL = 0.95


def lower_confidence(faults: int, rays: int, confidence: float = LEVEL) -> float:
    """The share at which as many faults or more have a probability of just 1 - confidence.

    The counterpart of `judge.upper_confidence`: 0 where there are no faults.
    """
    if faults < 1:
        return 0.0
    k = np.arange(faults)           # fewer faults than there are
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
    """Rays that prove a share below ``share`` when none of them is at fault: about 3 / share."""
    return math.ceil(math.log1p(-confidence) / math.log1p(-share))
