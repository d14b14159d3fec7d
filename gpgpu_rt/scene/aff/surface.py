"""Surface: the material of AFF's fill statements."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..material import Material
from ..texture import Texture
from ..values import Vector

CLEAR = 0.5     # a surface that transmits at least this share of the light becomes a dielectric


@dataclass(frozen=True)
class Surface:
    """A surface of AFF.

    The ambient share of a fill statement is left out, because the surroundings light the scene.
    So is the shininess: BART's ray tracers reflect the specular share like a mirror.

    Attributes
    ----------
    diffuse, mirror : (3,) shares in [0, 1] whose sum is at most 1
    ior : the refractive index of a dielectric, which has no other share; None for other surfaces
    """

    diffuse: Vector
    mirror: Vector
    ior: float | None = None

    @classmethod
    def of(cls, diffuse: np.ndarray, specular: np.ndarray, transmittance: float,
           ior: float) -> Surface:
        """Return the surface of a fill statement: (3,) shares, the transmitted share and the
        refractive index, where 0 stands for 1. Shares above 1 are cut; together with the diffuse
        share, the specular one gives way."""
        if transmittance >= CLEAR:
            return cls((0.0,) * 3, (0.0,) * 3, float(np.clip(ior or 1.0, 0.1, 10)))
        diffuse = np.clip(diffuse, 0, 1)
        return cls(_shares(diffuse), _shares(np.clip(specular, 0, 1 - diffuse)))

    def material(self, name: str, texture: Texture | None) -> Material:
        """Return the material of this surface; a dielectric has no texture."""
        if self.ior is not None:
            return Material(name, ior=self.ior)
        return Material(name, self.diffuse, self.mirror, texture=texture)


def _shares(values: Any) -> Vector:
    x, y, z = map(float, values)
    return x, y, z
