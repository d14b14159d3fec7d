"""A pass whose vertex program makes its geometry from the number of each vertex alone."""
from __future__ import annotations

from collections.abc import Mapping

import moderngl

from ..errors import Error
from ..gpu import Gpu
from ..shader import compile_program
from .full_screen import GL_SAMPLERS


class VertexPass:
    """A program drawn as points, lines or triangles without attributes: what a vertex is, its
    program looks up in tables and textures.

    Parameters
    ----------
    vertex, fragment : files under ``glsl/``
    virtual : what ``#include <name>`` stands for, in both
    defines : of the fragment program
    """

    def __init__(self, gpu: Gpu, vertex: str, fragment: str, virtual: Mapping[str, str],
                 defines: Mapping[str, object] | None = None) -> None:
        self.gpu, self.name = gpu, fragment
        self.program = compile_program(gpu, fragment, defines, virtual, vertex)
        self._geometry = gpu.context.vertex_array(self.program, [])
        self.samplers = [name for name in self.program
                         if getattr(self.program[name], "gl_type", None) in GL_SAMPLERS]

    def draw(self, target: moderngl.Framebuffer, textures: Mapping[str, moderngl.Texture],
             vertices: int, mode: int, uniforms: Mapping[str, object]) -> None:
        """Draw ``vertices``; more textures and uniforms may be given than the program reads."""
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
            self._geometry.render(mode, vertices=vertices)

    def release(self) -> None:
        self._geometry.release()
