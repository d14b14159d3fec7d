"""What rasterising first hits draws into, as large as the image."""
from __future__ import annotations

import moderngl
import numpy as np

from ...gl.context import Gpu
from ...gl.textures import make_texture, release, stream_samplers, stream_textures, texture_bytes
from ...rays.records import HIT
from ...rays.textures import StateBuffer, StateBuffers
from .records import SHOWN, SHOWN_BLOCK, SHOWN_FOUR

BLOCK = 8    # pixels a side of a square that is hidden, or is a triangle's own, as a whole
PART_SIDE = 32    # of the parts of the image in which large triangles look for themselves


class FirstImage:
    """Candidates, hits and doubts of one image.

    Attributes
    ----------
    drawn : candidates by the depth test
    verified : the hits, and which rays are in doubt
    proved : the same, and what pixels show
    targets : what fours and squares of pixels show, by record
    doubted : which rays are in doubt
    """

    def __init__(self, gpu: Gpu, buffers: StateBuffers, final: StateBuffer) -> None:
        self.final = final
        width, height = size = buffers.size
        self.candidates = make_texture(gpu, size, 1, "candidates")
        self.streams = {
            SHOWN.name: [make_texture(gpu, size, 2, "what pixels show")],
            SHOWN_FOUR.name: stream_textures(gpu, SHOWN_FOUR, (-(-width // 4), height)),
            SHOWN_BLOCK.name: stream_textures(gpu, SHOWN_BLOCK,
                                              (-(-width // BLOCK), -(-height // BLOCK)))}
        self.doubt = gpu.context.texture(size, 1)
        # The state's own depth buffer: schedules clear it before they mask rays by it.
        framebuffer = gpu.context.framebuffer
        self.drawn = framebuffer([self.candidates], buffers.depth)
        self.verified = framebuffer([*final.streams[HIT.name], self.doubt])
        self.proved = framebuffer([*final.streams[HIT.name], *self.streams[SHOWN.name],
                                   self.doubt])
        self.targets = {name: framebuffer(textures) for name, textures in self.streams.items()}
        self.doubted = framebuffer([self.doubt])

    @property
    def textures(self) -> list[moderngl.Texture]:
        return [self.candidates, *(t for textures in self.streams.values() for t in textures)]

    def samplers(self) -> dict[str, moderngl.Texture]:
        return {sampler: texture for name, textures in self.streams.items()
                for sampler, texture in stream_samplers(name, textures).items()}

    def bytes(self) -> int:
        return texture_bytes(self.textures) + self.doubt.width * self.doubt.height

    def release(self) -> None:
        release(self.drawn, self.verified, self.proved, self.doubted, self.targets,
                self.textures, self.doubt)


def cut(rows: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """(k, 3) PART: each of the rows in every part of the image from its first to its last."""
    across = last % 1024 - first % 1024 + 1
    owner = np.repeat(np.arange(len(rows)), across * (last // 1024 - first // 1024 + 1))
    within = np.arange(len(owner)) - np.searchsorted(owner, owner)
    x = first[owner] % 1024 + within % across[owner]
    y = first[owner] // 1024 + within // across[owner]
    return np.stack([rows[owner], PART_SIDE * x, PART_SIDE * y], axis=1)
