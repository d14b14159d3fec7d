"""Values: checks numbers and vectors from users; errors name the quantity that is wrong."""
from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import SceneError
from ..text_format import shortened

Vector = tuple[float, float, float]
LARGEST = 1e30      # shaders multiply these values in float32, which overflows near 3.4e38


def vector(value: Any, what: str, least: float = -np.inf, most: float = np.inf) -> Vector:
    """Return three finite numbers in [least, most], or raise a SceneError that names ``what``."""
    try:
        array = np.asarray(value, np.float64)
    except (TypeError, ValueError, OverflowError):
        array = np.empty(0)
    if array.shape != (3,) or not np.isfinite(array).all() or isinstance(value, str):
        raise SceneError(f"{what} is {shortened(value)}; give three finite numbers")
    if (np.abs(array) > LARGEST).any():
        raise SceneError(f"{what} is {array.tolist()}; give numbers up to {LARGEST:g}")
    if (array < least).any() or (array > most).any():
        raise SceneError(f"{what} is {array.tolist()}; give three numbers {_range(least, most)}")
    x, y, z = array.tolist()
    return x, y, z


def number(value: Any, what: str, least: float = -np.inf, most: float = np.inf) -> float:
    """Return a finite number in [least, most], or raise a SceneError that names ``what``."""
    try:
        found = np.nan if isinstance(value, (bool, str)) else float(value)
    except (TypeError, ValueError, OverflowError):
        found = np.nan
    if not np.isfinite(found):
        raise SceneError(f"{what} is {shortened(value)}; give a finite number")
    if abs(found) > LARGEST:
        raise SceneError(f"{what} is {found:g}; give a number up to {LARGEST:g}")
    if not least <= found <= most:
        raise SceneError(f"{what} is {found:g}; give a number {_range(least, most)}")
    return found


def _range(least: float, most: float) -> str:
    if most == np.inf:
        return f"that {'is' if least else 'is not'} " + (f"{least:g} or more" if least
                                                         else "negative")
    return f"in [{least:g}, {most:g}]"
