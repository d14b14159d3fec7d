"""Pace: choose the resolution of the next picture so that the user does not wait."""
from __future__ import annotations

from collections.abc import Callable

MOVING = 0.07       # limit in seconds for a picture while the camera moves
AT_REST = 0.6       # limit in seconds for a picture while the camera rests
# If every picture that is finer than the shown picture would exceed AT_REST, draw the coarsest of
# them, but only within this limit in seconds.
PATIENCE = 3.0
STALE = 3.0         # seconds after which a measured time is ignored, unless it is the newest time
DIVISORS = (1, 2, 3, 4, 6, 8, 12, 16)   # divisors of width and height; 1 draws every pixel
UNKNOWN = 8         # the divisor before any time is measured


class Pace:
    """Records the times of pictures and chooses the divisor of the next picture's size."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._seconds: dict[int, tuple[float, float]] = {}     # divisor -> (seconds, when)

    def measured(self, divisor: int, seconds: float) -> None:
        self._seconds[divisor] = (seconds, self._clock())

    def forget(self) -> None:
        """Drop all times."""
        self._seconds.clear()

    def estimate(self, divisor: int) -> float | None:
        """Return the estimated time of a picture in seconds, or None without measurements.

        The time of the nearest measured divisor is scaled in proportion to the pixels. For a finer
        picture, the result is too high, because of fixed costs.
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
        return self._finest(DIVISORS, MOVING, DIVISORS[-1])

    def resting(self, shown: int | None) -> int | None:
        """Return the divisor of the next picture, which is finer than ``shown``, or None.

        Choose the finest picture whose estimated time is at most ``AT_REST``. If there is none,
        choose the coarsest picture that is finer than ``shown``, unless it exceeds ``PATIENCE``.
        """
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
