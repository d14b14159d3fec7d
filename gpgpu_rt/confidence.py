"""Confidence: what k faults among n rays prove of the share of faults (Clopper and Pearson)."""
from __future__ import annotations

import math

from .judge import upper_confidence

LEVEL = 0.95


def lower_confidence(faults: int, rays: int, confidence: float = LEVEL) -> float:
    """The share at which as many faults have a probability of just 1 - confidence; 0 of none."""
    return 1.0 - upper_confidence(rays - faults, rays, confidence) if rays and faults else 0.0


def rays_needed(share: float, confidence: float = LEVEL) -> int:
    """Rays that prove a share below ``share`` when none of them is at fault: about 3 / share."""
    return math.ceil(math.log1p(-confidence) / math.log1p(-share))
