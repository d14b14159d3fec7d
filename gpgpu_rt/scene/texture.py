"""Texture: an image that colours a surface or surrounds a scene."""
from __future__ import annotations

import contextlib
import os
import struct
import warnings
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from ..disk.arrays import read_npy
from ..disk.budget import check_texels
from ..disk.files import open_input
from ..errors import LimitError, SceneError

_BLOCK = 1 << 18    # texels that are converted at a time, to bound the memory
# Exceptions that Pillow raises for damaged files.
_UNREADABLE = (OSError, ValueError, SyntaxError, EOFError, TypeError, IndexError, KeyError,
               OverflowError, struct.error, zlib.error, RuntimeError, AttributeError,
               NotImplementedError, Image.DecompressionBombError)


@contextlib.contextmanager
def quietly() -> Iterator[None]:
    """Silence Pillow's warnings about large images in this context; the memory budget rejects
    such images."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)
        yield


@dataclass(frozen=True, eq=False)
class Texture:
    """An image that is sampled with bilinear filtering.

    Attributes
    ----------
    name : the texture's name in errors and plans
    texels : (height, width, 3) float32, linear and not negative, row 0 at the top
    """

    name: str
    texels: np.ndarray = field(repr=False)

    def __post_init__(self) -> None:
        texels = np.ascontiguousarray(self.texels, np.float32)
        if texels.ndim != 3 or texels.shape[2] != 3 or not texels.size:
            raise SceneError(f"texture {self.name}: shape {texels.shape}; give (height, width, 3)")
        # Round to half floats, as GPU textures do, so that the reference samples the same values.
        # Convert rows in blocks to avoid a second full copy.
        halves = np.empty_like(texels)
        rows = max(1, _BLOCK // texels.shape[1])
        for first in range(0, len(texels), rows):
            block = texels[first:first + rows]
            if not (np.isfinite(block).all() and (block >= 0).all()):
                raise SceneError(f"texture {self.name}: a texel is negative or not finite; repair "
                                 "it")
            halves[first:first + rows] = np.minimum(block, 65504).astype(np.float16)
        object.__setattr__(self, "texels", halves)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Texture:
        """Return the texture of the file ``path``: an sRGB image, or an .npy file with a linear
        (height, width, 3) array.

        Raises
        ------
        SceneError
            the file does not exist or holds no image
        LimitError
            the image has more texels than the budget allows
        """
        path = Path(path)
        try:
            if path.suffix.lower() == ".npy":
                return cls(path.name, _numbers(path))
            with open_input(path) as file, quietly(), Image.open(file) as image:
                return cls.from_image(image, path.name)
        except FileNotFoundError:
            raise SceneError(f"{path}: no such texture; check the path") from None
        except MemoryError:
            raise LimitError(f"{path}: not enough memory for this texture; make it smaller"
                             ) from None
        except _UNREADABLE as failure:
            reason = " ".join(str(getattr(failure, "strerror", None) or failure).split())[:120]
            raise SceneError(f"{path}: cannot read this texture ({reason}); is it an image?"
                             ) from None

    @classmethod
    def from_image(cls, image: Image.Image, name: str = "image") -> Texture:
        """Return the texture of an sRGB PIL image; alpha is ignored. Errors use ``name``.

        Raises
        ------
        LimitError
            the image has more texels than the budget allows; it is not decoded
        SceneError
            the pixels cannot be decoded
        """
        check_texels(*image.size, name)
        try:
            bytes_ = np.asarray(image if image.mode == "RGB" else image.convert("RGB"))
        except _UNREADABLE as failure:
            reason = " ".join(str(failure).split())[:120]
            raise SceneError(f"{name}: cannot read this texture ({reason}); is it an image?"
                             ) from None
        made = object.__new__(cls)      # no rounding needed: _LINEAR holds half floats
        object.__setattr__(made, "name", name)
        object.__setattr__(made, "texels", _LINEAR[bytes_])
        return made

    def sample(self, uv: Any) -> np.ndarray:
        """Return (n, 3) float64 linear colours at (n, 2) texture coordinates ``uv``. (0, 0) is the
        lower left corner; the image repeats. ``glsl/render/texture.glsl`` does the same."""
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
    """Return the array of an .npy file. Raise ValueError unless it holds real numbers."""
    with open_input(path) as file:
        if file.read(6) != b"\x93NUMPY":
            raise ValueError("not a single array as numpy.save writes it")
    array = read_npy(path)
    if array.dtype.kind not in "fiu":
        raise ValueError(f"its numbers are of type {array.dtype}; give real numbers")
    return array


def linear(srgb: np.ndarray) -> np.ndarray:
    """Convert sRGB values in [0, 1] to linear light."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


# The linear value of each byte of an sRGB image, rounded to half and stored as float32.
_LINEAR = linear(np.arange(256) / 255).astype(np.float32).astype(np.float16).astype(np.float32)
