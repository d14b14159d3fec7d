"""Live tiles: finds the parts of the ray textures whose rays still wait for a kernel."""
from __future__ import annotations

from collections.abc import Mapping

import moderngl
import numpy as np

from ..gl.context import Gpu
from ..gl.full_screen import MOST_RECTANGLES, FullScreenPass, Rectangles
from ..gl.textures import make_texture, read_texture, release

TILE = 16   # width and height of a tile in rays


class Tiles:
    """Counts, in each tile, the rays that wait for each kernel.

    The pass of a kernel skips tiles without such rays, as the cards of 2002-2007 did by
    hierarchical depth. Late in a traversal, a renderer without hierarchical depth would otherwise
    spend most of its time on depth tests. Hits do not depend on the tiles.
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
        """Choose every tile, to begin a traversal."""
        self._counts[:] = 1
        self.choose(None)

    def count(self, samplers: Mapping[str, moderngl.Texture]) -> None:
        """Count the waiting rays of the tiles that the latest ``choose`` chose.

        Other tiles count as empty. The caller ensures that these tiles contain no live ray.
        """
        context = self._gpu.context
        context.enable_only(moderngl.NOTHING)
        self._gpu.clear(self._target)
        self._program.set(size=self.size)
        self._program.draw(self._target, samplers, rectangles=self.rectangles, unit=TILE)
        self._counts = read_texture(self._texture)
        context.enable_only(moderngl.DEPTH_TEST)

    def choose(self, kernel: int | None) -> None:
        """Choose the tiles with rays that wait for this kernel; None stands for any kernel."""
        counts = self._counts.sum(2) if kernel is None else self._counts[:, :, kernel - 1]
        # The target clips the last tile. Do not cut the tile here: the rectangles are also drawn
        # into the texture of counts, where a cut tile could miss the centre of its texel.
        self.rectangles.write(rectangles_of(counts > 0))

    def release(self) -> None:
        release(self._program, self._target, self._texture, self.rectangles)


def rectangles_of(wanted: np.ndarray) -> np.ndarray:
    """Return the corners, (n, 4) in texels, of rectangles that cover the tiles of a mask.

    ``wanted`` is a (rows, columns) bool array. Each run of tiles in a row becomes a rectangle. A
    single rectangle covers the whole mask if `Rectangles` cannot hold all runs.
    """
    edges = np.diff(np.pad(wanted, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, first = np.nonzero(edges == 1)
    _, end = np.nonzero(edges == -1)
    corners = np.stack([first, row, end, row + 1], 1)
    if len(corners) > MOST_RECTANGLES:
        corners = np.array([[0, 0, *wanted.shape[::-1]]])
    return corners * TILE
