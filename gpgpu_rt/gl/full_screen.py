"""Full-screen passes: a program runs on every texel of a target, or on chosen rectangles."""
from __future__ import annotations

from collections.abc import Mapping

import moderngl
import numpy as np

from ..statistics import Statistics
from .context import Gpu
from .fragment_pass import FragmentPass
from .target import Drawable
from .textures import release

MOST_RECTANGLES = 1 << 14


class Rectangles:
    """Rectangles of a target, in a vertex buffer.

    Parameters
    ----------
    capacity : largest number of rectangles
    """

    def __init__(self, gpu: Gpu, capacity: int = MOST_RECTANGLES) -> None:
        self.buffer = gpu.context.buffer(reserve=16 * capacity, dynamic=True)
        self._gpu, self.count = gpu, 0
        self.corners = np.zeros((0, 4), np.float32)

    def write(self, corners: np.ndarray) -> None:
        """Replace the rectangles by (n, 4) corners x0, y0, x1, y1. `FullScreenPass.draw` divides
        the corners by its ``unit`` to get texels."""
        self.corners, self.count = np.ascontiguousarray(corners, np.float32), len(corners)
        if self.count:
            self.buffer.write(self.corners)
            self._gpu.note_moved(up=self.corners.nbytes)

    def release(self) -> None:
        self.buffer.release()


class FullScreenPass(FragmentPass):
    """A fragment program that runs on the texels of rectangles."""

    def __init__(self, gpu: Gpu, fragment: str, defines: Mapping[str, object] | None = None,
                 virtual: Mapping[str, str] | None = None) -> None:
        super().__init__(gpu, fragment, defines, virtual)
        self.reads = tuple(name for name in self.reads if name not in ("scale", "depth"))
        self._whole = Rectangles(gpu, 1)
        self._geometry: dict[Rectangles, moderngl.VertexArray] = {}
        self._size: tuple[int, int] | None = None
        self._area = self._whole, 1     # rectangles and unit of the last draw

    def covered(self, size: tuple[int, int]) -> np.ndarray:
        """Return the texels of the last draw, like ``FragmentPass.covered``, but never None."""
        rectangles, unit = self._area
        width, height = size
        edges = np.zeros((height + 1, width + 1), np.int64)
        x0, y0, x1, y1 = np.clip(np.ceil(rectangles.corners / unit - 0.5).astype(np.int64), 0,
                                 [width, height, width, height]).T
        for y, x, step in ((y0, x0, 1), (y0, x1, -1), (y1, x0, -1), (y1, x1, 1)):
            np.add.at(edges, (y, x), step)
        return np.argwhere(edges.cumsum(0).cumsum(1)[:-1, :-1] > 0)[:, ::-1]

    def draw(self, target: Drawable, textures: Mapping[str, moderngl.Texture],
             depth: float = 0.0, rectangles: Rectangles | None = None,
             unit: int = 1) -> None:
        """Run the program on the texels of ``target`` that pass the depth test.

        Parameters
        ----------
        textures : sampler name -> texture; unsampled textures are ignored
        depth : window depth in [0, 1], written and tested
        rectangles : the rectangles to draw; None draws the whole target
        unit : the number by which corners are divided to get texels
        """
        size = target.size
        if rectangles is None:
            rectangles = self._whole
            if self._size != size:
                rectangles.write(np.array([[0, 0, 2 * size[0], 2 * size[1]]]) * unit)
                self._size = size
        self.program["scale"].value = (2.0 / (unit * size[0]), 2.0 / (unit * size[1]))
        self.program["depth"].value = 2.0 * depth - 1.0
        self._area = rectangles, unit
        geometry = self._geometry.get(rectangles)
        if geometry is None:
            geometry = self._geometry[rectangles] = self.gpu.context.vertex_array(
                self.program, [(rectangles.buffer, "4f/i", "rectangle")])
        if rectangles is self._whole:   # a triangle twice as large as the target
            self.issue(geometry, target, textures, moderngl.TRIANGLES, 3)
        else:
            self.issue(geometry, target, textures, moderngl.TRIANGLE_STRIP, 4, rectangles.count)

    def count(self, target: Drawable, textures: Mapping[str, moderngl.Texture],
              statistics: Statistics, depth: float = 0.0,
              rectangles: Rectangles | None = None) -> int:
        """Draw within an occlusion query, and return the number of drawn texels."""
        query = self.gpu.query()
        with query:
            self.draw(target, textures, depth, rectangles)
        statistics.draw_calls += 1
        statistics.queries += 1
        return int(query.samples)

    def release(self) -> None:
        release(self._geometry, self._whole)
