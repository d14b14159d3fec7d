"""Stack atlas: stores rays' stacks in a texture (Ernst, Vogelgsang and Greiner 2004)."""
from __future__ import annotations

from collections.abc import Mapping

import moderngl
import numpy as np

from ..gl.context import Gpu
from ..gl.full_screen import MOST_RECTANGLES, FullScreenPass, Rectangles
from ..gl.precision import Precision
from ..gl.record import Record
from ..gl.target import Target
from ..gl.textures import release


class StackAtlas:
    """A texture with a tile for each stack level. Each tile is as large as the state textures.

    Parameters
    ----------
    entry : record of a stack entry
    state : record of the method's state, as the state textures store it
    levels : number of stack levels
    size : (width, height) in rays or packets
    defines : the method's defines, including its phases
    """

    def __init__(self, gpu: Gpu, entry: Record, state: Record, levels: int, size: tuple[int, int],
                 precision: Precision, defines: Mapping[str, object]) -> None:
        self.gpu, self.size = gpu, size
        # A row holds as many tiles as the renderer's largest texture allows.
        a_row = max(1, min(levels, gpu.max_texture_size // size[0]))
        atlas = (size[0] * a_row, size[1] * -(-levels // a_row))
        gpu.check_size(*atlas, f"a stack of {levels} levels for {size[0] * size[1]} rays")
        stored = precision.layout(entry)
        self.target = Target(gpu, stored, atlas)
        self._program = FullScreenPass(
            gpu, "drivers/push.frag",
            {**defines, **precision.defines()},
            {"streams": state.stream_glsl(False) + "\n" + stored.stream_glsl(True)})
        self.uniforms = {"tile_size": size, "tiles_a_row": a_row,
                         f"{entry.name}_texel_size": (1 / atlas[0], 1 / atlas[1])}
        self._program.set(**self.uniforms)
        level = np.arange(levels)
        self._corners = np.stack([level % a_row, level // a_row], 1) * size
        self._where = Rectangles(gpu)
        self._live: np.ndarray | None = None    # the rectangles from which ``_where`` was made

    def push(self, state: Mapping[str, moderngl.Texture], live: Rectangles | None = None) -> None:
        """Push the entries of all rays in phase PUSH.

        Parameters
        ----------
        live : the parts of the state textures that can hold rays in phase PUSH; None for all
        """
        self.gpu.context.enable_only(moderngl.NOTHING)
        self._program.draw(self.target, state, rectangles=self._on_every_level(live))
        self.gpu.context.enable_only(moderngl.DEPTH_TEST)

    def _on_every_level(self, live: Rectangles | None) -> Rectangles | None:
        """Return the rectangles of ``live``, repeated in each level's tile. If MOST_RECTANGLES
        would be exceeded, return None, which stands for the whole atlas."""
        if live is None or live.count * len(self._corners) > MOST_RECTANGLES:
            return None
        if live.corners is not self._live:
            within = np.minimum(live.corners.reshape(-1, 2, 2), self.size)
            self._where.write((self._corners[:, None, None] + within).reshape(-1, 4))
            self._live = live.corners
        return self._where

    def samplers(self) -> Mapping[str, moderngl.Texture]:
        return self.target.samplers()

    def bytes(self) -> int:
        return self.target.bytes()

    def release(self) -> None:
        release(self._program, self.target, self._where)
