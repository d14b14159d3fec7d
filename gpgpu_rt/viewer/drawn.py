"""Drawn: the cost of a picture, for the graphs."""
from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Drawn:
    """The cost of a picture.

    Attributes
    ----------
    divisor : the picture has the width and height of its part of the window, divided by this
        number
    seconds : time for drawing and readback
    rays, passes : rays and passes of all waves (a wave is a set of rays that are traced together)
    live : a number of live rays for each time that the tracer counted them; empty under a schedule
        that does not count live rays
    """

    divisor: int
    seconds: float
    rays: int
    passes: int
    live: tuple[int, ...]

    @property
    def rays_per_second(self) -> float:
        return self.rays / max(self.seconds, 1e-9)
