"""A pass: one program run on every texel of a target, or on those of chosen rectangles."""
from __future__ import annotations

from collections.abc import Mapping

import moderngl
import numpy as np

from ..errors import Error
from ..gpu import Gpu
from ..shader import compile_program

GL_SAMPLERS = (0x8B5E, 0x8DD2)   # sampler2D, usampler2D
MOST_RECTANGLES = 1 << 14


class Rectangles:
    """Rectangles of a target, kept in a vertex buffer: what a pass is drawn on.

    Parameters
    ----------
    capacity : rectangles it holds at most
    """

    def __init__(self, gpu: Gpu, capacity: int = MOST_RECTANGLES) -> None:
        self.buffer = gpu.context.buffer(reserve=16 * capacity, dynamic=True)
        self.count = 0

    def write(self, corners: np.ndarray) -> None:
        """Take (n, 4) corners: x0, y0, x1, y1 in texels."""
        self.count = len(corners)
        if self.count:
            self.buffer.write(np.ascontiguousarray(corners, np.float32))


class FullScreenPass:
    """A fragment program from ``glsl/passes/`` and the geometry it is drawn with."""

    def __init__(self, gpu: Gpu, fragment: str, defines: Mapping[str, object] | None = None,
                 virtual: Mapping[str, str] | None = None) -> None:
        self.gpu = gpu
        self.name = fragment
        self.program = compile_program(gpu, fragment, defines, virtual)
        self._whole = Rectangles(gpu, 1)
        self._geometry: dict[int, moderngl.VertexArray] = {}
        self._size: tuple[int, int] | None = None
        self._uniforms: dict[str, object] = {}
        self._samplers = [name for name in self.program
                          if getattr(self.program[name], "gl_type", None) in GL_SAMPLERS]
        for unit, name in enumerate(self._samplers):
            self.program[name].value = unit

    @property
    def samplers(self) -> tuple[str, ...]:
        """Names of the textures that the program reads once it is compiled."""
        return tuple(self._samplers)

    def set(self, **uniforms: object) -> None:
        """Set uniforms by name; one that this variant compiled away is passed over."""
        self._uniforms.update({name: value for name, value in uniforms.items()
                               if name in self.program})
        self.program.extra = None   # what it was last drawn with no longer holds

    def _take_program(self) -> None:
        """Give the program this pass's uniforms: passes of the same text share one program."""
        if self.program.extra is not self:
            for name, value in self._uniforms.items():
                self.program[name].value = value
            self.program.extra = self

    def draw(self, target: moderngl.Framebuffer, textures: Mapping[str, moderngl.Texture],
             depth: float = 0.0, rectangles: Rectangles | None = None,
             unit: int = 1) -> None:
        """Run on the texels of ``target`` that the depth test lets through.

        Parameters
        ----------
        textures : sampler name -> texture; more than the program samples may be given
        depth : window depth in [0, 1] to write and test with
        rectangles : where to draw; None is everywhere
        unit : what ``rectangles`` counts, in texels of the target: 1 / unit texels each
        """
        self._take_program()
        attached = {texture.glo for texture in target.color_attachments}
        for slot, name in enumerate(self._samplers):
            texture = textures[name]
            if texture.glo in attached:   # GL would not say so: results are undefined
                raise Error(f"{self.name} samples {name} while drawing into it")
            texture.use(slot)
        size = target.size
        if rectangles is None:
            rectangles = self._whole
            if self._size != size:
                rectangles.write(np.array([[0, 0, 2 * size[0], 2 * size[1]]]) * unit)
                self._size = size
        self.program["scale"].value = (2.0 / (unit * size[0]), 2.0 / (unit * size[1]))
        self.program["depth"].value = 2.0 * depth - 1.0
        target.use()
        geometry = self._geometry.get(id(rectangles))
        if geometry is None:
            geometry = self._geometry[id(rectangles)] = self.gpu.context.vertex_array(
                self.program, [(rectangles.buffer, "4f/i", "rectangle")])
        if rectangles is self._whole:   # one triangle, twice as large as the target
            geometry.render(moderngl.TRIANGLES, vertices=3, instances=1)
        elif rectangles.count:
            geometry.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=rectangles.count)

    def release(self) -> None:
        for geometry in self._geometry.values():
            geometry.release()
        self._whole.buffer.release()
