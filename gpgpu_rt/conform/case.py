"""Case: a scene with rays that ray tracers may get wrong. FAMILIES is the table of families."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..scene.scene import Scene


@dataclass
class Case:
    """A scene and its rays.

    Attributes
    ----------
    triangles : (m, 3, 3) float32, world units
    origins, directions : (n, 3) float32, world units; directions of any length but 0
    closed : whether every ray must hit something, however the triangle test rounds
    options : method name -> options that the case sets
    t_min, t_max : (n,) float32, or one value for all rays, in units of |direction|
    """

    triangles: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    closed: bool = False
    options: dict[str, dict[str, Any]] = field(default_factory=dict)
    t_min: np.ndarray | float = 0.0
    t_max: np.ndarray | float = np.inf

    def __post_init__(self) -> None:
        self.triangles, self.origins, self.directions = (
            np.ascontiguousarray(a, np.float32)
            for a in (self.triangles, self.origins, self.directions))
        self.t_min, self.t_max = (np.asarray(end, np.float32) for end in (self.t_min, self.t_max))

    @property
    def rays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The arguments of ``Tracer.trace``."""
        return self.origins, self.directions, self.t_min, self.t_max

    @property
    def scene(self) -> Scene:
        """The scene of these triangles, which share no vertices."""
        corners = self.triangles.reshape(-1, 3)
        return Scene.from_arrays(corners, np.arange(len(corners)).reshape(-1, 3))

    def part(self, rays: np.ndarray | slice) -> Case:
        n = len(self.origins)
        ends = (np.broadcast_to(end, n)[rays] for end in (self.t_min, self.t_max))
        return Case(self.triangles, self.origins[rays], self.directions[rays], self.closed,
                    self.options, *ends)


@dataclass(frozen=True)
class Family:
    """A family of cases.

    Attributes
    ----------
    name : the name in tables and files
    row : the row in the table of cases in docs/extremes.md
    what : describes scene and rays
    make : (rays, seed) -> case; the scene does not depend on the number of rays
    most : the largest number of rays in the suite, small for slow scenes
    """

    name: str
    row: int
    what: str
    make: Callable[[int, int], Case]
    most: int


FAMILIES: dict[str, Family] = {}


def family(name: str, row: int, what: str, most: int = 1 << 30) -> Callable:
    """Return a decorator that registers a function (rays, seed) -> case."""
    def register(make: Callable[[int, int], Case]) -> Callable[[int, int], Case]:
        FAMILIES[name] = Family(name, row, what, make, most)
        return make
    return register
