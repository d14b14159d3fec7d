"""Built scene: the result of a scene generator, and a collector of coloured pieces."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..camera import Camera
from .shapes import divide

Colour = Sequence[float] | np.ndarray


@dataclass
class Built:
    """A procedural scene.

    Attributes
    ----------
    triangles : (n, 3, 3) float, world units
    colours : (n, 3) diffuse in [0, 1], or (3,) for all triangles
    camera : the scene's camera
    light : (3,) position of the point light
    intensity : (3,) intensity of the point light
    charts : as in Scene, if the scene is a geometry image
    appearance : further arguments of Scene, such as materials and normals; its ``lights`` replace
        ``light``
    """

    triangles: np.ndarray
    colours: np.ndarray
    camera: Camera
    light: tuple[float, float, float]
    intensity: tuple[float, float, float] = (1.0, 1.0, 1.0)
    charts: tuple[tuple[int, int], ...] = ()
    appearance: Mapping[str, Any] = field(default_factory=dict)


class Pieces:
    """Collects triangles and their colours."""

    def __init__(self) -> None:
        self._triangles: list[np.ndarray] = []
        self._colours: list[np.ndarray] = []

    def __len__(self) -> int:
        return sum(len(part) for part in self._triangles)

    def add(self, triangles: np.ndarray, colour: Colour) -> None:
        """Add (k, 3, 3) triangles in one colour, (3,), or in m colours, (m, 3), each for k / m
        consecutive triangles."""
        colour = np.atleast_2d(np.asarray(colour, np.float64))
        self._triangles.append(triangles)
        self._colours.append(np.repeat(colour, len(triangles) // len(colour), axis=0))

    def arrays(self) -> tuple[np.ndarray, np.ndarray]:
        """Return triangles (n, 3, 3) and colours (n, 3), in the order of ``add``."""
        return np.concatenate(self._triangles), np.concatenate(self._colours)

    def finish(self, count: int, camera: Camera, light: tuple[float, float, float],
               intensity: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Built:
        """Return the scene, with its largest triangles divided to reach exactly `count`
        triangles."""
        triangles, colours = self.arrays()
        triangles, part_of = divide(triangles, count)
        return Built(triangles, colours[part_of], camera, light, intensity)
