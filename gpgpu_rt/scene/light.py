"""Lights: point lights and surroundings. Materials describe the emission of triangles."""
from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import SceneError
from .image_light import ImageLight
from .texture import Texture
from .values import Vector, vector

BLACK: Vector = (0.0, 0.0, 0.0)
SKY_LOW, SKY_HIGH = np.array((0.86, 0.88, 0.90)), np.array((0.42, 0.55, 0.72))


@dataclass(frozen=True)
class PointLight:
    """A point light.

    Attributes
    ----------
    position : (3,), world units
    intensity : (3,), the radiance that a white surface reflects if it faces the light: the
        surface's irradiance divided by pi. The light does not decrease with distance; OpenGL's
        fixed-function lighting has the same default
    """

    position: Any
    intensity: Any = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", vector(self.position, "light: position"))
        object.__setattr__(self, "intensity", vector(self.intensity, "light: intensity", 0))


@dataclass(frozen=True)
class Environment:
    """The light of the surroundings, for rays that miss all triangles.

    Attributes
    ----------
    kind : "backdrop", a pale sky with weak light from everywhere, for pictures of plain meshes;
        "sky", a gradient between two colours; or "image"
    zenith, ground : (3,) radiance of a sky from straight above and straight below; linear in the
        direction's y in between
    image : an equirectangular image of all directions, with -z in its middle column and +y in its
        top row
    """

    kind: str
    zenith: Any = BLACK
    ground: Any = BLACK
    image: Texture | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if self.kind not in ("backdrop", "sky", "image"):
            raise SceneError(f"environment: kind is {self.kind!r}; give backdrop, sky or image")
        for name in ("zenith", "ground"):
            object.__setattr__(self, name, vector(getattr(self, name), f"environment: {name}", 0))
        if (self.image is not None) != (self.kind == "image"):
            raise SceneError(f"environment: a {self.kind} "
                             f"{'has no' if self.image is not None else 'needs an'} image")

    @classmethod
    def constant(cls, colour: Any) -> Environment:
        """Return an environment of radiance ``colour`` everywhere, (3,) linear RGB, 0 or more."""
        return cls("sky", colour, colour)

    @classmethod
    def sky(cls, zenith: Any, ground: Any) -> Environment:
        """Return an environment with radiance linear in the direction's y, from ``ground`` below
        to ``zenith`` above, (3,) linear RGB each."""
        return cls("sky", zenith, ground)

    @classmethod
    def surrounded(cls, image: Texture) -> Environment:
        """Return an environment of an equirectangular ``image`` of linear radiance."""
        return cls("image", image=image)

    @property
    def emits(self) -> bool:
        """Whether any light comes from the environment."""
        return self.kind == "backdrop" or any(self.zenith) or any(self.ground) or (
            self.image is not None and bool(self.image.texels.any()))

    @cached_property
    def image_light(self) -> ImageLight | None:
        """The sampling table of the image; None without an image, or for a black image."""
        return None if self.image is None else ImageLight.of(self.image.texels)

    def radiance(self, directions: np.ndarray) -> np.ndarray:
        """Return the radiance, (n, 3) float64, from (n, 3) unit directions, as in
        ``render/surroundings.glsl``."""
        d = np.asarray(directions, np.float64)
        if self.kind == "backdrop":
            up = np.clip((d[:, 1:2] + 0.3) / 1.2, 0, 1)
            return SKY_LOW + (SKY_HIGH - SKY_LOW) * up * up * (3 - 2 * up)
        if self.kind == "sky":
            up = 0.5 + 0.5 * d[:, 1:2]
            return np.asarray(self.ground) * (1 - up) + np.asarray(self.zenith) * up
        assert self.image is not None
        uv = np.stack([0.5 + np.arctan2(d[:, 0], -d[:, 2]) / (2 * np.pi),
                       0.5 + np.arcsin(np.clip(d[:, 1], -1, 1)) / np.pi], axis=1)
        # Textures repeat, but the first and the last row are not neighbours: clamp the rows.
        margin = 0.5 / self.image.texels.shape[0]
        return self.image.sample(np.stack([uv[:, 0], np.clip(uv[:, 1], margin, 1 - margin)], 1))

    def ambient(self) -> np.ndarray:
        """Return the coefficients, (4, 3) float64, of the light that a white surface reflects.

        Without shadows, a surface of normal n reflects row 0 plus the product of n and rows 1 to
        3. The sum is exact for a sky. For an image, the sum has only the constant and linear
        spherical harmonics, which suffice for Whitted's ambient term. Ramamoorthi and Hanrahan
        (2001) use the quadratic harmonics too. For a backdrop, the coefficients are 0, because
        shaders compute its light by a formula.
        """
        if self.kind == "backdrop":
            return np.zeros((4, 3))
        if self.image is None:
            zenith, ground = np.asarray(self.zenith), np.asarray(self.ground)
            return np.stack([(zenith + ground) / 2, np.zeros(3), (zenith - ground) / 3,
                             np.zeros(3)])
        texels = self.image.texels.astype(np.float64)
        height, width = texels.shape[:2]
        theta = np.pi * (0.5 - (np.arange(height) + 0.5) / height)
        phi = 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
        d = np.stack(np.broadcast_arrays(
            np.cos(theta)[:, None] * np.sin(phi), np.sin(theta)[:, None] * np.ones(width),
            -np.cos(theta)[:, None] * np.cos(phi)), axis=-1)
        weight = np.cos(theta)[:, None, None] / (np.cos(theta).sum() * width)
        mean = (texels * weight).sum((0, 1))
        slope = 3 * np.einsum("hwa,hwc->ac", d, texels * weight)
        return np.concatenate([mean[None], 2 / 3 * slope])


BACKDROP = Environment("backdrop")
