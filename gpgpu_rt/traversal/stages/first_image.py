"""First image: makes the render targets of rasterised first hits."""
from __future__ import annotations

import moderngl
import numpy as np

from ...gl.context import Gpu
from ...gl.target import Target
from ...gl.textures import make_texture, release, texture_bytes
from ...rays.records import HIT
from ...rays.textures import StateBuffers
from .records import SHOWN, SHOWN_BLOCK, SHOWN_FOUR

# Side of a square in pixels. For each triangle T, the search for rivals (first_hits.py) skips a
# square that hides T, or that shows only T.
BLOCK = 8
# Side in pixels of the parts into which the search cuts the rectangle of a large triangle.
PART_SIDE = 32


class FirstImage:
    """The render targets of an image: candidates, hits, and flags of rays in doubt.

    Attributes
    ----------
    drawn : the candidates, which the depth test chooses
    shown : each pixel's depth and triangle
    fours : the data of ``shown``, with four pixels of a row in each texel
    blocks : the depths and triangles of squares whose side is BLOCK pixels
    verified : the hits, and the flags of rays in doubt
    proved : the hits, the flags of rays in doubt, and each pixel's depth and triangle
    doubted : only the flags of rays in doubt
    """

    def __init__(self, gpu: Gpu, buffers: StateBuffers, final: Target) -> None:
        self.final = final
        width, height = size = buffers.size
        self.candidates = make_texture(gpu, size, 1, "candidates")
        self.doubt = gpu.context.texture(size, 1)
        self._depths = make_texture(gpu, size, 2, "depths and triangles")
        self.shown = Target(gpu, SHOWN, size, borrowed={SHOWN.name: [self._depths]})
        self.fours = Target(gpu, SHOWN_FOUR, (-(-width // 4), height))
        self.blocks = Target(gpu, SHOWN_BLOCK, (-(-width // BLOCK), -(-height // BLOCK)))
        hits, doubt = {HIT.name: final.streams[HIT.name]}, {"doubt": [self.doubt]}
        # Sharing the states' depth buffer is safe: schedules clear it before they mask rays.
        self.drawn = gpu.context.framebuffer([self.candidates], buffers.depth)
        self.verified = Target(gpu, (), size, borrowed={**hits, **doubt})
        self.proved = Target(gpu, (), size, borrowed={**hits, **self.shown.streams, **doubt})
        self.doubted = Target(gpu, (), size, borrowed=doubt)

    def samplers(self) -> dict[str, moderngl.Texture]:
        return {**self.shown.samplers(), **self.fours.samplers(), **self.blocks.samplers()}

    def bytes(self) -> int:
        """Return the bytes of the textures except the hits."""
        return (texture_bytes([self.candidates, self._depths]) + self.fours.bytes()
                + self.blocks.bytes() + self.doubt.width * self.doubt.height)

    def release(self) -> None:
        release(self.drawn, self.verified, self.proved, self.doubted, self.shown, self.fours,
                self.blocks, self.candidates, self.doubt, self._depths)


def cut(rows: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Return the (k, 3) fields of the record PART for each triangle of ``rows`` and each part of
    the triangle's rectangle: the triangle's row, and the first pixel (x, y) of the part.

    ``first`` and ``last`` are the numbers of the first and the last part of each rectangle. The
    part in column x and row y has the number x + 1024 y.
    """
    across = last % 1024 - first % 1024 + 1
    owner = np.repeat(np.arange(len(rows)), across * (last // 1024 - first // 1024 + 1))
    within = np.arange(len(owner)) - np.searchsorted(owner, owner)
    x = first[owner] % 1024 + within % across[owner]
    y = first[owner] // 1024 + within // across[owner]
    return np.stack([rows[owner], PART_SIDE * x, PART_SIDE * y], axis=1)
