"""Tiles: which parts of the ray textures still hold rays that a pass has work for."""
from __future__ import annotations

from collections.abc import Mapping

import moderngl
import numpy as np

from ..gl.context import Gpu
from ..gl.full_screen import MOST_RECTANGLES, FullScreenPass, Rectangles
from ..gl.textures import make_texture, read_texture, release

TILE = 16   # rays a side


class Tiles:
    """Counts by tile the rays that wait for each kernel, to draw only where there are any.

    Period hardware left out masked tiles by hierarchical depth. A renderer without one tests every
    fragment of every pass, which late in a traversal is all it does; the host's list of tiles
    takes the place of that unit, and hits are the same without it.
    """

    def __init__(self, gpu: Gpu, size: tuple[int, int], streams: str) -> None:
        self.size = size
        self._gpu = gpu
        self._shape = (-(-size[0] // TILE), -(-size[1] // TILE))
        self._texture = make_texture(gpu, self._shape, 4, "tile counts")
        self._target = gpu.context.framebuffer([self._texture])
        self._program = FullScreenPass(gpu, "drivers/tile_counts.frag", {"TILE": TILE},
                                       {"streams": streams})
        self.rectangles = Rectangles(gpu)
        self._counts = np.zeros((*self._shape[::-1], 4), np.float32)
        self.everywhere()

    def everywhere(self) -> None:
        """Every tile, before anything was counted."""
        self._counts[:] = 1
        self.choose(None)

    def count(self, samplers: Mapping[str, moderngl.Texture]) -> None:
        """Count anew in the tiles chosen last; all others hold no live ray."""
        context = self._gpu.context
        context.enable_only(moderngl.NOTHING)
        self._target.clear()
        self._program.set(size=self.size)
        self._program.draw(self._target, samplers, rectangles=self.rectangles, unit=TILE)
        self._counts = read_texture(self._texture)
        context.enable_only(moderngl.DEPTH_TEST)

    def choose(self, kernel: int | None) -> None:
        """Draw where rays wait for a kernel, or, None, for any."""
        counts = self._counts.sum(2) if kernel is None else self._counts[:, :, kernel - 1]
        # Whole tiles, also past the last ray: what is outside the target is clipped, and a cut
        # tile would miss the centre of its own texel in the counts.
        self.rectangles.write(rectangles_of(counts > 0))

    def release(self) -> None:
        release(self._program, self._target, self._texture, self.rectangles)


def rectangles_of(wanted: np.ndarray) -> np.ndarray:
    """(n, 4) corners, in texels, of rectangles that cover the tiles of a (rows, columns) mask.

    Runs of tiles side by side become one; where they are more than `Rectangles` hold, all is
    covered."""
    edges = np.diff(np.pad(wanted, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, first = np.nonzero(edges == 1)
    _, end = np.nonzero(edges == -1)
    corners = np.stack([first, row, end, row + 1], 1)
    if len(corners) > MOST_RECTANGLES:
        corners = np.array([[0, 0, *wanted.shape[::-1]]])
    return corners * TILE
