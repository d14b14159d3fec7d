"""Material: how a surface reflects, refracts and emits light."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import SceneError
from .texture import Texture
from .values import Vector, number, vector

GREY: Vector = (0.60, 0.58, 0.54)    # diffuse share of a material that declares no part
LEAST_ROUGHNESS = 0.01


@dataclass(frozen=True)
class Material:
    """The light that a surface reflects, refracts and emits: the sum of the parts below. Both
    sides of a triangle behave alike, except for a dielectric.

    Attributes
    ----------
    name : The material's name in errors, scene files and mesh files.
    diffuse : (3,) share of light that is scattered by Lambert's law. With a texture, the default
        is white. Without a texture, it is light grey if no other part is given, else black.
    mirror : (3,) share that is reflected in the mirror direction.
    glossy : (3,) share that is reflected into a lobe around the mirror direction.
    roughness : Roughness r of the lobe, 0.01 to 1. The lobe is cos^n with n = 2 / r^2 - 2.
    ior : None, or for a dielectric the refractive index inside divided by the index outside. A
        dielectric reflects by Fresnel's equations and refracts the rest, so the three shares above
        must be 0. The corners of its triangles must run anticlockwise as seen from outside.
    emission : (3,) radiance that both sides emit in all directions.
    texture : None, or the texture that multiplies ``diffuse``.
    """

    name: str = "material"
    diffuse: Any = None
    mirror: Any = (0.0, 0.0, 0.0)
    glossy: Any = (0.0, 0.0, 0.0)
    roughness: float = 0.2
    ior: float | None = None
    emission: Any = (0.0, 0.0, 0.0)
    texture: Texture | None = None

    def __post_init__(self) -> None:
        where = f"material {self.name}: "
        said = {}
        for part in ("mirror", "glossy"):
            said[part] = vector(getattr(self, part), where + part, 0, 1)
        said["emission"] = vector(self.emission, where + "emission", 0)
        if self.diffuse is None:
            other = self.ior is not None or any(any(value) for value in said.values())
            said["diffuse"] = (0.0, 0.0, 0.0) if other and self.texture is None else (
                GREY if self.texture is None else (1.0, 1.0, 1.0))
        else:
            said["diffuse"] = vector(self.diffuse, where + "diffuse", 0, 1)
        for part, value in said.items():
            object.__setattr__(self, part, value)
        number(self.roughness, where + "roughness", LEAST_ROUGHNESS, 1)
        shares = np.sum([said[part] for part in ("diffuse", "mirror", "glossy")], axis=0)
        if self.ior is not None:
            number(self.ior, where + "ior", 0.1, 10)
            if shares.any():
                raise SceneError(f"{where}a dielectric reflects or refracts all light; remove "
                                 "ior, or remove all of diffuse, mirror, glossy and texture")
        if (shares > 1 + 1e-6).any():
            raise SceneError(f"{where}diffuse, mirror and glossy add up to "
                             f"{np.round(shares, 3).tolist()}; no surface reflects more than 1")
        if self.texture is not None and not isinstance(self.texture, Texture):
            raise SceneError(f"{where}texture is {self.texture!r}; give a Texture, as "
                             "Texture.load(path) returns it")

    @property
    def emits(self) -> bool:
        """Whether the material emits light."""
        return any(self.emission)

    @property
    def exponent(self) -> float:
        """The exponent of the cosine in the glossy lobe."""
        return 2 / self.roughness ** 2 - 2
