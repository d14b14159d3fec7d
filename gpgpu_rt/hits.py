"""Hits: the result of a trace, one entry per ray."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from .errors import OptionError, nearest_names

TRACED, INVALID, UNFINISHED, STACK_OVERFLOW = 0, 1, 2, 3


@dataclass
class Hits:
    """The nearest hits of n rays.

    Attributes
    ----------
    t : (n,) float, distance in units of the ray's |direction|; inf on a miss
    u, v : (n,) float, barycentric coordinates: p = (1 - u - v) v0 + u v1 + v v2; 0 on a miss
    triangle : (n,) int32, row of the hit triangle in the scene's faces; -1 on a miss
    status : (n,) uint8, 0 traced, 1 invalid ray, 2 unfinished (step cap), 3 stack overflow
    nodes_visited, leaves_visited, triangles_tested : (n,) int32, or None without statistics
    steps : (n,) int32, the number of kernel runs for the ray, or None without statistics
    shape : shape of the ray arrays without their last axis: (n,), or (h, w) for (h, w, 3)
    """

    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    triangle: np.ndarray
    status: np.ndarray
    nodes_visited: np.ndarray | None = None
    leaves_visited: np.ndarray | None = None
    triangles_tested: np.ndarray | None = None
    steps: np.ndarray | None = None
    shape: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        self.shape = tuple(self.shape) or (len(self.t),)

    def __len__(self) -> int:
        return len(self.t)

    @property
    def hit(self) -> np.ndarray:
        """(n,) bool, true where the ray hit a triangle."""
        return self.triangle >= 0

    def image(self, name: str) -> np.ndarray:
        """Return the array of a field, or ``hit``, in the shape of the rays: (h, w) for (h, w, 3).

        Raises
        ------
        OptionError
            if these hits have no array of this name
        """
        known = [*self.to_dict(), "hit"]
        if name not in known:
            raise OptionError(f"hits have no array {name!r}{nearest_names(name, known)}")
        return getattr(self, name).reshape(self.shape)

    def to_dict(self) -> dict[str, Any]:
        """Return the arrays that are present, by field name, ready for ``numpy.savez``."""
        pairs = ((f.name, getattr(self, f.name)) for f in fields(self) if f.name != "shape")
        return {name: array for name, array in pairs if array is not None}


def joined(parts: Sequence[Hits]) -> Hits:
    """Return the hits of several sets of rays as the hits of a single set, in the same order."""
    found = [part.to_dict() for part in parts]
    return Hits(**{name: np.concatenate([one[name] for one in found]) for name in found[0]})
