"""Drawn: what a picture took, for the graphs."""
from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Drawn:
    """What a picture took.

    Attributes
    ----------
    divisor : of the window's width and height
    seconds : drawing and reading it back
    rays, passes : of all its waves
    live : rays not over at each count, under the schedules that count
    """

    divisor: int
    seconds: float
    rays: int
    passes: int
    live: tuple[int, ...]

    @property
    def rays_per_second(self) -> float:
        return self.rays / max(self.seconds, 1e-9)
