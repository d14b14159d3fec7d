"""A pass: a fragment program, run wherever geometry that is drawn makes fragments for it."""
from __future__ import annotations

from collections.abc import Mapping

import moderngl
import numpy as np

from ..errors import Error
from .context import Gpu
from .shader import compile_program
from .target import Drawable, framebuffer_of

LISTS = (moderngl.POINTS, moderngl.LINES, moderngl.TRIANGLES)   # of primitives by themselves
GL_SAMPLERS = (0x8B5E, 0x8DD2)   # sampler2D, usampler2D


class FragmentPass:
    """A linked program and what it reads; full-screen passes and others bring the geometry.

    Parameters
    ----------
    fragment, vertex : files under ``glsl/``
    defines, virtual : as for ``compile_program``

    Attributes
    ----------
    name : the fragment program's file
    vertex : the vertex program's file
    texts : the (vertex, fragment) text that was compiled
    label : what a log calls it; empty where that is its name
    kernel : the method's kernel that it runs, as ``ObservedPass`` has it; empty where it runs none
    samplers : names of the textures that the program reads once it is compiled
    uniforms : those that were set, by name
    """

    def __init__(self, gpu: Gpu, fragment: str, defines: Mapping[str, object] | None = None,
                 virtual: Mapping[str, str] | None = None,
                 vertex: str = "drivers/full_screen.vert") -> None:
        self.gpu = gpu
        self.name, self.vertex, self.label, self.kernel = fragment, vertex, "", ""
        self.program = compile_program(gpu, fragment, defines, virtual, vertex)
        self.texts = gpu.text_of(self.program)
        self.uniforms: dict[str, object] = {}
        self._mark = object()       # that it leaves on the program, which must not hold the pass
        self.samplers = tuple(name for name in self.program if getattr(
            self.program[name], "gl_type", None) in GL_SAMPLERS)
        for unit, name in enumerate(self.samplers):
            self.program[name].value = unit

    def set(self, **uniforms: object) -> None:
        """Set uniforms by name; one that this variant compiled away is passed over."""
        self.uniforms.update({name: value for name, value in uniforms.items()
                              if name in self.program})
        self.program.extra = None   # what it was last drawn with no longer holds

    def covered(self, size: tuple[int, int]) -> np.ndarray | None:
        """(n, 2) int, x and y: the texels of a target of (width, height) that the last draw
        covers, before the depth test; None where the pass does not know."""
        return None

    def issue(self, geometry: moderngl.VertexArray, target: Drawable,
              textures: Mapping[str, moderngl.Texture], mode: int, vertices: int = -1,
              instances: int = 1) -> None:
        """Draw geometry into ``target``: textures bound, uniforms set, observers told.

        Parameters
        ----------
        textures : sampler name -> texture; more than the program samples may be given
        mode : moderngl.POINTS, TRIANGLES, ...
        vertices : how many of each instance; -1 is all that the geometry has
        """
        self._take_program()
        framebuffer = framebuffer_of(target)
        attached = {texture.glo for texture in framebuffer.color_attachments or ()}
        for unit, name in enumerate(self.samplers):
            if name not in textures:
                raise Error(f"{self.name} samples {name}, which it was not given")
            if textures[name].glo in attached:   # GL would not say so: results are undefined
                raise Error(f"{self.name} samples {name} while drawing into it")
            textures[name].use(unit)
        framebuffer.use()
        if not self.gpu.observers:
            self._render(geometry, mode, vertices, instances)
            return
        self.gpu.observers.draw(self, target, framebuffer,
                                {name: textures[name] for name in self.samplers},
                                lambda: self._render(geometry, mode, vertices, instances))

    def _take_program(self) -> None:
        """Give the program this pass's uniforms: passes of the same text share one program."""
        if self.program.extra is not self._mark:
            for name, value in self.uniforms.items():
                self.program[name].value = value
            self.program.extra = self._mark

    def _render(self, geometry: moderngl.VertexArray, mode: int, vertices: int,
                instances: int) -> int:
        """Draw; lists of more vertices than the renderer numbers come a part at a time. How many
        draw calls that took."""
        count = geometry.vertices if vertices < 0 else vertices
        most = self.gpu.most_vertices
        if most is None or instances != 1 or mode not in LISTS:
            most = count
        parts = range(0, count if instances else 0, max(most, 1))
        for first in parts:
            geometry.render(mode, min(most, count - first), first=first, instances=instances)
        return len(parts)
