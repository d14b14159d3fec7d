"""Axes: scales whose ticks are plain, round numbers such as 380 or 0.02."""
from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.ticker import FuncFormatter, Locator, MaxNLocator, NullLocator

MOST_TICKS = 7
FEWEST_TICKS = 3
# Choices of ticks on a logarithmic axis, from many ticks to few. A tuple has the first digits of
# the ticks in a decade. An integer n puts a tick at every n-th power of ten.
_DIGITS: tuple[tuple[float, ...] | int, ...] = ((1, 2, 5), (1, 3), 1, 2, 3, 4, 6)


def plain(value: float, digits: int = 3) -> str:
    """Return a number with ``digits`` significant digits and no exponent: ``1,230``."""
    if not value or not math.isfinite(value):
        return f"{value:g}"
    value = float(f"{value:.{digits}g}")
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    text = f"{value:,.{places}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def log_axis(axis: Any, which: str, base: int = 10) -> None:
    """Make an axis logarithmic.

    Parameters
    ----------
    axis : the matplotlib Axes
    which : "x" or "y"
    base : 10, or 2 for numbers that are powers of two
    """
    axis.set(**{f"{which}scale": "log"})
    one = getattr(axis, f"{which}axis")
    one.set_major_locator(_LogTicks(base))
    one.set_minor_locator(NullLocator())
    one.set_major_formatter(FuncFormatter(lambda value, _: plain(value, 6)))


def linear_axis(axis: Any, which: str) -> None:
    """Begin an axis at zero, and write its numbers without an exponent."""
    axis.set(**{f"{which}scale": "linear"})
    getattr(axis, f"set_{which}lim")(0)
    getattr(axis, f"{which}axis").set_major_formatter(
        FuncFormatter(lambda value, _: plain(value, 6)))


class _LogTicks(Locator):
    """Up to MOST_TICKS round numbers at base 10, or up to ten powers of two at base 2."""

    def __init__(self, base: int) -> None:
        self.base = base

    def __call__(self) -> Any:
        return self.tick_values(*self.axis.get_view_interval())

    def tick_values(self, vmin: float, vmax: float) -> Any:
        low, high = sorted((vmin, vmax))
        if low <= 0 or not math.isfinite(high):
            return []
        if self.base == 2:
            return _powers_of_two(low, high)
        for digits in _DIGITS:
            found = _within(digits, low, high)
            if len(found) <= MOST_TICKS:
                break
        if len(found) < FEWEST_TICKS:       # the axis covers less than a decade
            even = MaxNLocator(6, steps=[1, 2, 5, 10]).tick_values(low, high)
            found = [tick for tick in even if low <= tick <= high]
        return found


def _within(digits: tuple[float, ...] | int, low: float, high: float) -> list[float]:
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    if isinstance(digits, int):     # count powers from 10^0, so that 1 has a tick
        return [10.0 ** k for k in range(first, last + 1)
                if not k % digits and low <= 10.0 ** k <= high]
    return [digit * 10.0 ** k for k in range(first, last + 1) for digit in digits
            if low <= digit * 10.0 ** k <= high]


def _powers_of_two(low: float, high: float) -> Any:
    powers = np.arange(math.ceil(math.log2(low)), math.floor(math.log2(high)) + 1)
    return 2.0 ** powers[::-(-len(powers) // 10) or 1]
