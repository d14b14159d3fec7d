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

    The shininess of a fill statement is ignored: the specular share reflects like a mirror, as the
    authors of BART require. The ambient share is ignored too, because the environment lights the
    scene. But a surface without diffuse and specular shares, such as the garden behind BART's
    kitchen, uses its ambient share as its diffuse share.

    Attributes
    ----------
    diffuse, mirror : (3,) shares in [0, 1] whose sum is at most 1
    ior : the refractive index of a dielectric, whose shares are 0; None for other surfaces
    """

    diffuse: Vector
    mirror: Vector
    ior: float | None = None

    @classmethod
    def of(cls, ambient: np.ndarray, diffuse: np.ndarray, specular: np.ndarray,
           transmittance: float, ior: float) -> Surface:
        """Return the surface of a fill statement.

        Parameters
        ----------
        ambient, diffuse, specular : (3,) shares; the specular share is reduced where specular and
            diffuse add up to more than 1
        transmittance : the share of light that passes through
        ior : the refractive index; 0 means 1
        """
        if transmittance >= CLEAR:
            return cls((0.0,) * 3, (0.0,) * 3, float(np.clip(ior or 1.0, 0.1, 10)))
        diffuse = np.clip(diffuse if diffuse.any() or specular.any() else ambient, 0, 1)
        return cls(_shares(diffuse), _shares(np.clip(specular, 0, 1 - diffuse)))

    def material(self, name: str, texture: Texture | None) -> Material:
        """Return the material of this surface; a dielectric has no texture."""
        if self.ior is not None:
            return Material(name, ior=self.ior)
        return Material(name, self.diffuse, self.mirror, texture=texture)


def _shares(values: Any) -> Vector:
    x, y, z = map(float, values)
    return x, y, z
