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
        self._gpu, self.count = gpu, 0
        self.corners = np.zeros((0, 4), np.float32)

    def write(self, corners: np.ndarray) -> None:
        """Take (n, 4) corners: x0, y0, x1, y1 in texels."""
        self.corners, self.count = np.ascontiguousarray(corners, np.float32), len(corners)
        if self.count:
            self.buffer.write(self.corners)
            self._gpu.note_moved(up=self.corners.nbytes)


class FullScreenPass:
    """A fragment program from ``glsl/passes/`` and the geometry it is drawn with."""

    def __init__(self, gpu: Gpu, fragment: str, defines: Mapping[str, object] | None = None,
                 virtual: Mapping[str, str] | None = None) -> None:
        self.gpu = gpu
        self.name, self.label = fragment, ""   # the label: what it is called in a log
        self.program = compile_program(gpu, fragment, defines, virtual)
        self._whole = Rectangles(gpu, 1)
        self._geometry: dict[int, moderngl.VertexArray] = {}
        self._size: tuple[int, int] | None = None
        self._area = self._whole, 1     # of the draw that is watched
        self._uniforms: dict[str, object] = {}
        self._samplers = [name for name in self.program
                          if getattr(self.program[name], "gl_type", None) in GL_SAMPLERS]
        for unit, name in enumerate(self._samplers):
            self.program[name].value = unit

    @property
    def samplers(self) -> tuple[str, ...]:
        """Names of the textures that the program reads once it is compiled."""
        return tuple(self._samplers)

    @property
    def uniforms(self) -> dict[str, object]:
        """The uniforms that were set, by name."""
        return dict(self._uniforms)

    def covered(self, size: tuple[int, int]) -> np.ndarray:
        """(n, 2) int, x and y: the texels of a target of (width, height) that the draw being
        watched covers, before the depth test."""
        rectangles, unit = self._area
        width, height = size
        edges = np.zeros((height + 1, width + 1), np.int64)
        x0, y0, x1, y1 = np.clip(np.ceil(rectangles.corners / unit - 0.5).astype(np.int64), 0,
                                 [width, height, width, height]).T
        for y, x, step in ((y0, x0, 1), (y0, x1, -1), (y1, x0, -1), (y1, x1, 1)):
            np.add.at(edges, (y, x), step)
        return np.argwhere(edges.cumsum(0).cumsum(1)[:-1, :-1] > 0)[:, ::-1]

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
        if self.gpu.watch is not None:
            self._area = rectangles, unit
            self.gpu.watch.note(self, target, textures)
        target.use()
        geometry = self._geometry.get(id(rectangles))
        if geometry is None:
            geometry = self._geometry[id(rectangles)] = self.gpu.context.vertex_array(
                self.program, [(rectangles.buffer, "4f/i", "rectangle")])
        if self.gpu.log is None:
            self._render(geometry, rectangles)
            return
        used = {name: textures[name] for name in self._samplers}
        with self.gpu.drawing(self.label or self.name, self.program, target, used):
            self._render(geometry, rectangles)

    def _render(self, geometry: moderngl.VertexArray, rectangles: Rectangles) -> None:
        if rectangles is self._whole:   # one triangle, twice as large as the target
            geometry.render(moderngl.TRIANGLES, vertices=3, instances=1)
        elif rectangles.count:
            geometry.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=rectangles.count)

    def release(self) -> None:
        for geometry in self._geometry.values():
            geometry.release()
        self._whole.buffer.release()
