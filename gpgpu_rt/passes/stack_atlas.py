"""A stack a ray in the tiles of an atlas texture (Ernst, Vogelgsang and Greiner 2004)."""
from __future__ import annotations

from collections.abc import Mapping

import moderngl

from ..gpu import Gpu
from ..precision import Precision
from ..ray_state import stream_samplers
from ..record import Record
from ..textures import release, stream_textures, texture_bytes
from .full_screen import FullScreenPass


class StackAtlas:
    """One tile a stack level, each as large as the state textures.

    Parameters
    ----------
    entry : what a level of a ray's stack holds
    state : the method's state as its textures hold it
    levels : tiles
    size : (width, height) rays, or packets
    defines : the method's, phases among them
    """

    def __init__(self, gpu: Gpu, entry: Record, state: Record, levels: int, size: tuple[int, int],
                 precision: Precision, defines: Mapping[str, object]) -> None:
        self.gpu, self.size = gpu, size
        # As many tiles side by side as the renderer's largest texture holds.
        a_row = max(1, min(levels, gpu.max_texture_size // size[0]))
        atlas = (size[0] * a_row, size[1] * -(-levels // a_row))
        gpu.check_size(*atlas, f"a stack of {levels} levels for {size[0] * size[1]} rays")
        stored = precision.layout(entry)
        self.entry = entry
        self.textures = stream_textures(gpu, stored, atlas)
        self._target = gpu.context.framebuffer(self.textures)
        self._program = FullScreenPass(
            gpu, "passes/push.frag",
            {**defines, **precision.defines()},
            {"streams": state.stream_glsl(False) + "\n" + stored.stream_glsl(True)})
        self.uniforms = {"tile_size": size, "tiles_a_row": a_row}
        self._program.set(**self.uniforms)

    def push(self, state: Mapping[str, moderngl.Texture]) -> None:
        """Take up the entries of all rays in phase PUSH."""
        self.gpu.context.enable_only(moderngl.NOTHING)
        self._program.draw(self._target, state)
        self.gpu.context.enable_only(moderngl.DEPTH_TEST)

    def samplers(self) -> dict[str, moderngl.Texture]:
        return stream_samplers(self.entry.name, self.textures)

    def bytes(self) -> int:
        return texture_bytes(self.textures)

    def release(self) -> None:
        release(self._program, self._target, self.textures)
