"""EngineAnswers: an engine's answers to rays, in the form that the suite judges."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .case import Case


@dataclass
class EngineAnswers:
    """An engine's answers to n rays.

    Attributes
    ----------
    triangle : (n,) int, the nearest hit triangle; negative for a miss
    t : (n,) float, the hit's distance in units of |direction|, or None
    any_hit : (n,) bool, whether the ray hits anything, from a separate call of the engine, or None
    """

    triangle: np.ndarray
    t: np.ndarray | None = None
    any_hit: np.ndarray | None = None


Trace = Callable[[Case], EngineAnswers]


def of_distances(case: Case, t: np.ndarray, triangle: np.ndarray,
                 any_hit: np.ndarray | None = None) -> EngineAnswers:
    """Return the answers of an engine that knows no t_max: a hit beyond t_max becomes a miss. The
    caller ensures that no t_min of the case is above 0."""
    t, triangle = np.array(t, np.float64), np.array(triangle)
    for name, given in (("t", t), ("triangle", triangle)):
        if given.shape != (len(case.origins),):
            raise ValueError(f"{name} has shape {given.shape}; expected ({len(case.origins)},)")
    triangle[(triangle >= 0) & (t > case.t_max)] = -1
    return EngineAnswers(triangle, t, any_hit)
