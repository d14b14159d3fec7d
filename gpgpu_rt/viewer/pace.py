"""Pace: how fine the next picture can be without keeping anyone waiting."""
from __future__ import annotations

from collections.abc import Callable

MOVING = 0.07       # seconds that a picture may take while something moves
AT_REST = 0.6       # seconds that one step of refinement may take before a coarser one comes first
PATIENCE = 3.0      # seconds that the last step may take without being asked for
STALE = 3.0         # seconds after which a measured time is forgotten
DIVISORS = (1, 2, 3, 4, 6, 8, 12, 16)   # of width and height; 1 is every pixel
UNKNOWN = 8         # where nothing was measured yet


class Pace:
    """Learns what pictures take, and chooses the divisor of the next one's width and height."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._seconds: dict[int, tuple[float, float]] = {}     # divisor -> (seconds, when)

    def measured(self, divisor: int, seconds: float) -> None:
        """A picture took so long."""
        self._seconds[divisor] = (seconds, self._clock())

    def forget(self) -> None:
        """Something else is drawn from now on."""
        self._seconds.clear()

    def estimate(self, divisor: int) -> float | None:
        """Seconds that a picture would take, or None where nothing is known.

        From the nearest one that was measured, by the share of pixels: too much for a finer one,
        as what each picture costs whatever its size is counted along.
        """
        if not self._seconds:
            return None
        now = self._clock()
        newest = max(when for _, when in self._seconds.values())
        fresh = {d: s for d, (s, when) in self._seconds.items()
                 if now - when < STALE or when == newest}
        nearest = min(fresh, key=lambda d: abs(d - divisor))
        return fresh[nearest] * (nearest / divisor) ** 2

    def moving(self) -> int:
        """The divisor while something moves."""
        return self._finest(DIVISORS, MOVING, DIVISORS[-1])

    def resting(self, shown: int | None) -> int | None:
        """The divisor of the next finer picture than the one that is shown, or None: there is none
        that would not take longer than ``PATIENCE``."""
        finer = [d for d in DIVISORS if shown is None or d < shown]
        if not finer:
            return None
        found = self._finest(finer, AT_REST, 0)
        if found:
            return found
        estimate = self.estimate(finer[-1])
        return finer[-1] if estimate is None or estimate <= PATIENCE else None

    def _finest(self, divisors: tuple[int, ...] | list[int], limit: float, otherwise: int) -> int:
        if not self._seconds:
            return next((d for d in divisors if d >= UNKNOWN), otherwise)
        return next((d for d in divisors if (self.estimate(d) or 0.0) <= limit), otherwise)
