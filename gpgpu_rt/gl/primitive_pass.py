"""PrimitivePass: draws points that scatter, quads that bound shapes, or a mesh's triangles."""
from __future__ import annotations

from collections.abc import Mapping

import moderngl

from .context import Gpu
from .fragment_pass import FragmentPass
from .target import Drawable
from .textures import release


class PrimitivePass(FragmentPass):
    """Draws primitives. Vertices come from a buffer, or the vertex program makes each vertex from
    its number.

    Parameters
    ----------
    fragment, vertex, defines, virtual : as for ``FragmentPass``
    """

    def __init__(self, gpu: Gpu, fragment: str, vertex: str,
                 defines: Mapping[str, object] | None = None,
                 virtual: Mapping[str, str] | None = None) -> None:
        super().__init__(gpu, fragment, defines, virtual, vertex)
        self._buffer: moderngl.Buffer | None = None
        self._geometry: moderngl.VertexArray | None = None

    def take(self, buffer: moderngl.Buffer, layout: str, *attributes: str) -> None:
        """Draw the vertices of a buffer from now on.

        Parameters
        ----------
        layout : in moderngl's notation: "3f 1i" for a vertex or "4f/i" for an instance
        attributes : an attribute's name for each word of the layout; unused names are ignored
        """
        if self._buffer is not buffer:
            release(self._geometry)
            self._buffer, self._geometry = buffer, self.gpu.context.vertex_array(
                self.program, [(buffer, layout, *attributes)], skip_errors=True)

    def draw(self, target: Drawable, textures: Mapping[str, moderngl.Texture],
             mode: int, vertices: int = -1, instances: int = 1) -> None:
        """Draw the primitives, with the parameters of ``issue``."""
        if self._geometry is None:
            self._geometry = self.gpu.context.vertex_array(self.program, [])
        self.issue(self._geometry, target, textures, mode, vertices, instances)

    def release(self) -> None:
        release(self._geometry)
        self._buffer = self._geometry = None
