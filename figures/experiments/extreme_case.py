"""Extreme case: a scene and rays where ray tracers may fail, and the table of these cases."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import gpgpu_rt as rt


@dataclass
class Case:
    """A scene and its rays.

    Attributes
    ----------
    triangles : (m, 3, 3) float32
    origins, directions : (n, 3) float32
    closed : whether every ray must hit something, however the triangle test rounds
    options : method name -> options, for the methods whose options the case sets
    t_min : (n,) float32, or a single value for all rays
    """

    triangles: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    closed: bool = False
    options: dict[str, dict[str, Any]] = field(default_factory=dict)
    t_min: np.ndarray | float = 0.0

    def __post_init__(self) -> None:
        self.triangles, self.origins, self.directions = (
            np.ascontiguousarray(a, np.float32)
            for a in (self.triangles, self.origins, self.directions))
        self.t_min = np.asarray(self.t_min, np.float32)

    @property
    def scene(self) -> rt.Scene:
        corners = self.triangles.reshape(-1, 3)
        return rt.Scene.from_arrays(corners, np.arange(len(corners)).reshape(-1, 3))


@dataclass(frozen=True)
class Kind:
    """A kind of case: its name, its row in docs/extremes.md, and ``make(rays, seed)`` -> case."""

    name: str
    row: int
    what: str
    make: Callable[[int, int], Case]


CASES: dict[str, Kind] = {}


def entry(name: str, row: int, what: str) -> Callable:
    """Register a function (rays, seed) -> case in CASES, with its row in docs/extremes.md."""
    def register(make: Callable) -> Callable:
        CASES[name] = Kind(name, row, what, make)
        return make
    return register
