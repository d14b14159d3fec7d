"""Luminance: the brightness of linear RGB colours."""
from __future__ import annotations

import numpy as np

LUMINANCE = np.array((0.2126, 0.7152, 0.0722))


def luminance(colours: np.ndarray) -> np.ndarray:
    """Return the luminance, (...), of (..., 3) linear RGB."""
    return np.asarray(colours, np.float64) @ LUMINANCE
