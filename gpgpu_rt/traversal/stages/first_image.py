"""What rasterising first hits draws into, as large as the image."""
from __future__ import annotations

import moderngl
import numpy as np

from ...gl.context import Gpu
from ...gl.target import Target
from ...gl.textures import make_texture, release, texture_bytes
from ...rays.records import HIT
from ...rays.textures import StateBuffers
from .records import SHOWN, SHOWN_BLOCK, SHOWN_FOUR

BLOCK = 8    # pixels a side of a square that is hidden, or is a triangle's own, as a whole
PART_SIDE = 32    # of the parts of the image in which large triangles look for themselves


class FirstImage:
    """Candidates, hits and doubts of one image.

    Attributes
    ----------
    drawn : candidates by the depth test
    shown, fours, blocks : what pixels show, four in a row, and squares of BLOCK a side
    verified : the hits, and which rays are in doubt
    proved : the same, and what pixels show
    doubted : which rays are in doubt
    """

    def __init__(self, gpu: Gpu, buffers: StateBuffers, final: Target) -> None:
        self.final = final
        width, height = size = buffers.size
        self.candidates = make_texture(gpu, size, 1, "candidates")
        self.doubt = gpu.context.texture(size, 1)
        self._depths = make_texture(gpu, size, 2, "what pixels show")
        self.shown = Target(gpu, SHOWN, size, borrowed={SHOWN.name: [self._depths]})
        self.fours = Target(gpu, SHOWN_FOUR, (-(-width // 4), height))
        self.blocks = Target(gpu, SHOWN_BLOCK, (-(-width // BLOCK), -(-height // BLOCK)))
        hits, doubt = {HIT.name: final.streams[HIT.name]}, {"doubt": [self.doubt]}
        # The state's own depth buffer: schedules clear it before they mask rays by it.
        self.drawn = gpu.context.framebuffer([self.candidates], buffers.depth)
        self.verified = Target(gpu, (), size, borrowed={**hits, **doubt})
        self.proved = Target(gpu, (), size, borrowed={**hits, **self.shown.streams, **doubt})
        self.doubted = Target(gpu, (), size, borrowed=doubt)

    def samplers(self) -> dict[str, moderngl.Texture]:
        """Sampler name -> texture of what pixels, fours and blocks show."""
        return {**self.shown.samplers(), **self.fours.samplers(), **self.blocks.samplers()}

    def bytes(self) -> int:
        """Bytes of the textures, without the hits."""
        return (texture_bytes([self.candidates, self._depths]) + self.fours.bytes()
                + self.blocks.bytes() + self.doubt.width * self.doubt.height)

    def release(self) -> None:
        release(self.drawn, self.verified, self.proved, self.doubted, self.shown, self.fours,
                self.blocks, self.candidates, self.doubt, self._depths)


def cut(rows: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """(k, 3) PART: each of the rows in every part of the image from its first to its last."""
    across = last % 1024 - first % 1024 + 1
    owner = np.repeat(np.arange(len(rows)), across * (last // 1024 - first // 1024 + 1))
    within = np.arange(len(owner)) - np.searchsorted(owner, owner)
    x = first[owner] % 1024 + within % across[owner]
    y = first[owner] // 1024 + within // across[owner]
    return np.stack([rows[owner], PART_SIDE * x, PART_SIDE * y], axis=1)
