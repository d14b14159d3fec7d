"""Drawn: the cost of a picture, for the graphs."""
from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Drawn:
    """The cost of a picture.

    Attributes
    ----------
    divisor : the picture has the window's width and height divided by this number
    seconds : time for drawing and readback
    rays, passes : rays and passes of all waves (a wave is a set of rays that are traced together)
    live : the number of live rays at each count; empty under a schedule that does not count rays
    """

    divisor: int
    seconds: float
    rays: int
    passes: int
    live: tuple[int, ...]

    @property
    def rays_per_second(self) -> float:
        return self.rays / max(self.seconds, 1e-9)
