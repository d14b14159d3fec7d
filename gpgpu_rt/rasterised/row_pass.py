"""A pass whose vertex program makes its geometry, a few vertices for each number it is given."""
from __future__ import annotations

from collections.abc import Mapping

import moderngl
import numpy as np

from ..errors import Error
from ..gpu import Gpu
from ..passes.full_screen import GL_SAMPLERS
from ..shader import compile_program


class RowPass:
    """Draws ``vertices`` vertices for each of a list of integers, the attribute of the program.

    Parameters
    ----------
    vertex, fragment : files under ``glsl/``
    attribute : what the vertex program calls the integer
    vertices : vertices an integer; primitives are triangles, or points where it is 1
    """

    def __init__(self, gpu: Gpu, vertex: str, fragment: str, attribute: str, vertices: int,
                 defines: Mapping[str, object], virtual: Mapping[str, str]) -> None:
        self.gpu, self.name = gpu, fragment
        self.attribute, self.vertices = attribute, vertices
        self.program = compile_program(gpu, fragment, defines, virtual, vertex)
        self.samplers = [name for name in self.program
                         if getattr(self.program[name], "gl_type", None) in GL_SAMPLERS]
        self._buffer: moderngl.Buffer | None = None
        self._geometry: moderngl.VertexArray | None = None

    def draw(self, target: moderngl.Framebuffer, textures: Mapping[str, moderngl.Texture],
             rows: np.ndarray, uniforms: Mapping[str, object]) -> None:
        """Draw (n,) or (n, k) int ``rows``; more may be given than the program reads."""
        if not len(rows):
            return
        data = np.repeat(rows.astype(np.int32), self.vertices, axis=0)
        if self._buffer is None or self._buffer.size < data.nbytes:
            self._release_geometry()
            self._buffer = self.gpu.context.buffer(reserve=max(1 << 16, 2 * data.nbytes),
                                                   dynamic=True)
            self._geometry = self.gpu.context.vertex_array(
                self.program, [(self._buffer, f"{rows[0].size}i", self.attribute)])
        assert self._geometry is not None
        self._buffer.write(data)
        self.gpu.note_moved(up=data.nbytes)
        attached = {texture.glo for texture in target.color_attachments}
        for unit, name in enumerate(self.samplers):
            if textures[name].glo in attached:   # GL would not say so: results are undefined
                raise Error(f"{name} is read while it is drawn into")
            textures[name].use(unit)
            self.program[name].value = unit
        for name, value in uniforms.items():
            if name in self.program:
                self.program[name].value = value
        target.use()
        used = {name: textures[name] for name in self.samplers}
        with self.gpu.drawing(self.name, self.program, target, used):
            self._geometry.render(moderngl.POINTS if self.vertices == 1 else moderngl.TRIANGLES,
                                  vertices=len(data))

    def _release_geometry(self) -> None:
        for part in (self._geometry, self._buffer):
            if part is not None:
                part.release()

    def release(self) -> None:
        self._release_geometry()
        self._geometry = self._buffer = None
