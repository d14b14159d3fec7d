"""RowPass: draws points or triangles from a list of integers."""
from __future__ import annotations

from collections.abc import Mapping

import moderngl
import numpy as np

from .context import Gpu
from .fragment_pass import FragmentPass
from .target import Drawable
from .textures import release


class RowPass(FragmentPass):
    """Draws ``vertices`` vertices for each item of a list. An item is one or several integers.

    Parameters
    ----------
    vertex, fragment : files under ``glsl/``
    attribute : name of the integer or integer vector in the vertex program
    vertices : vertices per item: 1 for points, other numbers for triangles
    """

    def __init__(self, gpu: Gpu, vertex: str, fragment: str, attribute: str, vertices: int,
                 defines: Mapping[str, object], virtual: Mapping[str, str]) -> None:
        super().__init__(gpu, fragment, defines, virtual, vertex)
        self.attribute, self.vertices = attribute, vertices
        self._buffer: moderngl.Buffer | None = None
        self._geometry: moderngl.VertexArray | None = None

    def draw(self, target: Drawable, textures: Mapping[str, moderngl.Texture],
             rows: np.ndarray, uniforms: Mapping[str, object]) -> None:
        """Draw the items ``rows``, (n,) or (n, k) int. Ignore uniforms that the program lacks."""
        if not len(rows):
            return
        data = np.repeat(rows.astype(np.int32), self.vertices, axis=0)
        if self._buffer is None or self._buffer.size < data.nbytes:
            release(self._geometry, self._buffer)
            self._buffer = self.gpu.context.buffer(reserve=max(1 << 16, 2 * data.nbytes),
                                                   dynamic=True)
            self._geometry = self.gpu.context.vertex_array(
                self.program, [(self._buffer, f"{rows[0].size}i", self.attribute)])
        assert self._geometry is not None
        self._buffer.write(data)
        self.gpu.note_moved(up=data.nbytes)
        self.set(**uniforms)
        mode = moderngl.POINTS if self.vertices == 1 else moderngl.TRIANGLES
        self.issue(self._geometry, target, textures, mode, len(data))

    def release(self) -> None:
        release(self._geometry, self._buffer)
        self._geometry = self._buffer = None
