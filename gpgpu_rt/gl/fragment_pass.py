"""FragmentPass: a linked program that draws geometry, with its uniforms and textures."""
from __future__ import annotations

from collections.abc import Mapping

import moderngl
import numpy as np

from ..errors import Error
from .context import Gpu
from .shader import compile_program
from .target import Drawable, framebuffer_of

LISTS = (moderngl.POINTS, moderngl.LINES, moderngl.TRIANGLES)   # modes of separate primitives
GL_SAMPLERS = (0x8B5E, 0x8DD2)   # sampler2D, usampler2D


class FragmentPass:
    """A linked program with uniforms and samplers. Subclasses add the geometry.

    Parameters
    ----------
    fragment, vertex : files under ``glsl/``
    defines, virtual : as for ``compile_program``

    Attributes
    ----------
    name : the fragment program's file
    vertex : the vertex program's file
    texts : the compiled (vertex, fragment) texts
    label : the pass's name in logs; if empty, logs use ``name``
    kernel : the method's kernel, as in ``ObservedPass``, or empty
    samplers : names of the textures that the compiled program reads
    reads : names of the other uniforms that the compiled program reads. `FullScreenPass` leaves
        out ``scale`` and ``depth``, because it sets them at each draw
    uniforms : the values set so far, by name
    """

    def __init__(self, gpu: Gpu, fragment: str, defines: Mapping[str, object] | None = None,
                 virtual: Mapping[str, str] | None = None,
                 vertex: str = "drivers/full_screen.vert") -> None:
        self.gpu = gpu
        self.name, self.vertex, self.label, self.kernel = fragment, vertex, "", ""
        self.program = compile_program(gpu, fragment, defines, virtual, vertex)
        self.texts = gpu.text_of(self.program)
        self.uniforms: dict[str, object] = {}
        # Passes share programs. A program's ``extra`` is the mark of the pass that last set the
        # program's uniforms. If ``extra`` were the pass itself, the program would keep the pass
        # alive.
        self._mark = object()
        self.samplers = tuple(name for name in self.program if getattr(
            self.program[name], "gl_type", None) in GL_SAMPLERS)
        self.reads = tuple(name for name in self.program if name not in self.samplers
                           and isinstance(self.program[name], moderngl.Uniform))
        for unit, name in enumerate(self.samplers):
            self.program[name].value = unit

    def set(self, **uniforms: object) -> None:
        """Set uniforms by name. Ignore uniforms that the compiler removed."""
        self.uniforms.update({name: value for name, value in uniforms.items()
                              if name in self.program})
        self.program.extra = None   # the program's values are out of date

    def covered(self, size: tuple[int, int]) -> np.ndarray | None:
        """Return the texels (x, y) that the last draw covered before the depth test, (n, 2) int;
        None if they are not known. ``size`` is the target's (width, height)."""
        return None

    def issue(self, geometry: moderngl.VertexArray, target: Drawable,
              textures: Mapping[str, moderngl.Texture], mode: int, vertices: int = -1,
              instances: int = 1) -> None:
        """Draw geometry into ``target`` and call the observers.

        Parameters
        ----------
        textures : sampler name -> texture; names that the program does not sample are ignored
        mode : moderngl.POINTS, TRIANGLES, ...
        vertices : number of vertices per instance; -1 for all of the geometry
        """
        self._take_program()
        framebuffer = framebuffer_of(target)
        attached = {texture.glo for texture in framebuffer.color_attachments or ()}
        for unit, name in enumerate(self.samplers):
            if name not in textures:
                raise Error(f"{self.name} samples {name}, which was not given")
            if textures[name].glo in attached:   # GL reports no error, but the result is undefined
                raise Error(f"{self.name} samples {name} while drawing into it")
            textures[name].use(unit)
        framebuffer.use()
        if self.gpu.observers:
            self.gpu.observers.draw(self, target, framebuffer,
                                    {name: textures[name] for name in self.samplers},
                                    lambda: self._render(geometry, mode, vertices, instances))
        else:
            self._render(geometry, mode, vertices, instances)
            self.gpu.fences.keep()

    def _take_program(self) -> None:
        """Set this pass's uniforms, unless the program already has them: passes with the same
        texts share a program."""
        if self.program.extra is not self._mark:
            for name, value in self.uniforms.items():
                self.program[name].value = value
            self.program.extra = self._mark

    def _render(self, geometry: moderngl.VertexArray, mode: int, vertices: int,
                instances: int) -> int:
        """Draw, and return the number of draw calls. Separate primitives (`LISTS`) are drawn in
        parts if the renderer cannot number all vertices."""
        count = geometry.vertices if vertices < 0 else vertices
        most = self.gpu.most_vertices
        if most is None or instances != 1 or mode not in LISTS:
            most = count
        parts = range(0, count if instances else 0, max(most, 1))
        for first in parts:
            geometry.render(mode, min(most, count - first), first=first, instances=instances)
        return len(parts)
