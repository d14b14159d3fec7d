"""Drawn: the cost of a picture, for the graphs."""
from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Drawn:
    """The cost of a picture.

    Attributes
    ----------
    divisor : the picture is this many times smaller than its part of the window, along each axis
    seconds : time for drawing and readback
    rays, passes : rays and passes of all waves (sets of rays that are traced together)
    live : the numbers of live rays that the schedule counted, in order; empty without counts
    """

    divisor: int
    seconds: float
    rays: int
    passes: int
    live: tuple[int, ...]

    @property
    def rays_per_second(self) -> float:
        return self.rays / max(self.seconds, 1e-9)
