"""Texture: an image that colours a surface or surrounds a scene."""
from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from ..errors import SceneError


@dataclass(frozen=True, eq=False)
class Texture:
    """An image, read by bilinear filtering.

    Attributes
    ----------
    name : how errors and plans call it
    texels : (height, width, 3) float32, linear and not negative, row 0 at the top
    """

    name: str
    texels: np.ndarray = field(repr=False)

    def __post_init__(self) -> None:
        texels = np.ascontiguousarray(self.texels, np.float32)
        if texels.ndim != 3 or texels.shape[2] != 3 or not texels.size:
            raise SceneError(f"texture {self.name}: shape {texels.shape}; give (height, width, 3)")
        if not (np.isfinite(texels).all() and (texels >= 0).all()):
            raise SceneError(f"texture {self.name}: a texel is negative or not finite; repair it")
        # Textures hold half floats: what is checked and sampled is what the programs read.
        object.__setattr__(self, "texels",
                           np.minimum(texels, 65504).astype(np.float16).astype(np.float32))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Texture:
        """The texture of the file at ``path``: an image, sRGB; or .npy, linear (height, width, 3).

        Raises
        ------
        SceneError
            no such file, or no image in it
        """
        path = Path(path)
        if not os.path.isfile(path):    # unlike Path's, False for a name too long
            raise SceneError(f"{path}: no such texture; check the path")
        try:
            if path.suffix.lower() == ".npy":
                return cls(path.name, _numbers(path))
            with Image.open(path) as image:
                return cls.from_image(image, path.name)
        except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as failure:
            reason = " ".join(str(failure).split())[:120]
            raise SceneError(f"{path}: cannot read this texture ({reason}); is it an image?"
                             ) from None

    @classmethod
    def from_image(cls, image: Image.Image, name: str = "image") -> Texture:
        """The texture of a PIL image, sRGB, called ``name`` in messages; alpha is left out."""
        return cls(name, linear(np.asarray(image.convert("RGB"), np.float64) / 255))

    def sample(self, uv: Any) -> np.ndarray:
        """(n, 3) float64, linear, at (n, 2) texture coordinates ``uv``: (0, 0) is the lower left
        corner, and the image repeats. The twin of ``glsl/common/texture.glsl``."""
        height, width = self.texels.shape[:2]
        at = np.asarray(uv, np.float64)
        at = (at - np.floor(at)) * (1, -1) + (0, 1)
        at = at * (width, height) - 0.5
        first = np.floor(at).astype(np.int64)
        part = at - first
        (x0, y0), (x1, y1) = (first % (width, height)).T, ((first + 1) % (width, height)).T
        texels = self.texels.astype(np.float64)
        upper = texels[y0, x0] * (1 - part[:, :1]) + texels[y0, x1] * part[:, :1]
        lower = texels[y1, x0] * (1 - part[:, :1]) + texels[y1, x1] * part[:, :1]
        return upper * (1 - part[:, 1:]) + lower * part[:, 1:]


def _numbers(path: Path) -> np.ndarray:
    """The array of a .npy file; ValueError where it holds something else."""
    with open(path, "rb") as file:
        if file.read(6) != b"\x93NUMPY":
            raise ValueError("no single array of NumPy's, as numpy.save writes it")
    array: np.ndarray = np.load(path, allow_pickle=False)
    if array.dtype.kind not in "fiu":
        raise ValueError(f"its numbers are of type {array.dtype}; give real ones")
    return array


def linear(srgb: np.ndarray) -> np.ndarray:
    """sRGB in [0, 1] as linear light."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
