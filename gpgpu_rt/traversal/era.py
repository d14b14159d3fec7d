"""The era form: a method's kernels as the cards of 2002-2006 ran them, a kernel a pass.

The kernels are the texts of ``glsl/methods/`` in the era dialect (glsl/era/pass.glsl). Indices are
floats. Each texel of a record lies in a texture of its own. The state is what the paper kept. The
host chooses the kernel of each pass by occlusion queries. `EraKernel` has the text in two
dialects: ``card``, as the cards' compilers read it, and ``renderer``, as it runs here.
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..gl import era_accessors
from ..gl.full_screen import FullScreenPass
from ..gl.precision import Precision
from ..gl.shader import Source, resolve
from ..gl.target import Target
from ..options import word_define
from ..rays.records import HIT, RAY_TEXELS
from ..rays.textures import RayTextures, StateBuffers
from ..statistics import Statistics
from .driver import Samplers, Setup
from .live_tiles import Tiles
from .method import Accelerator, Method
from .schedules import DRAWN, ProgramKey, Traversal, kernel_defines

INIT = "init"     # the kernel that sets up the rays' states
TESTS_TRIANGLES = "intersect"     # in every row, the only kernel that changes hits


@dataclass(frozen=True)
class EraKernel:
    """A kernel in the era form.

    Attributes
    ----------
    name : the kernel's name; INIT for the pass that sets up states
    defines, virtual : for ``gl.shader.resolve`` with the file of a dialect
    writes_hit : whether the kernel can change a ray's hit. A kernel that cannot neither copies
        the hit
    """

    name: str
    defines: Mapping[str, object]
    virtual: Mapping[str, str]
    writes_hit: bool

    def source(self, dialect: str) -> Source:
        """Return the text in a dialect: ``card`` or ``renderer``."""
        return resolve(f"era/{dialect}.frag", self.defines, self.virtual)


def era_kernel(method: Method, options: Mapping[str, Any], name: str, any_hit: bool = False,
               defines: Mapping[str, object] | None = None) -> EraKernel:
    """Return a kernel of a method in the era form.

    Parameters
    ----------
    method : the row, formed by these options
    options : the options of the tracer and of the method, resolved with ``era``
    name : a kernel of the row, or INIT
    any_hit : whether rays stop at their first hit
    defines : the defines that follow from the accelerator
    """
    start = name == INIT
    chosen = {
        **method.defines(options), **(defines or {}), **Precision.of(options).defines(),
        **kernel_defines(method.kernels),
        word_define("INTERSECTION", options["intersection"]): True,
        "ERA": True, "ANY_HIT": any_hit, "START": start, "KERNEL": None if start else name,
        "KERNEL_PHASE": None if start else method.kernels.index(name) + 1}
    writes_hit = start or name == TESTS_TRIANGLES
    return EraKernel(name, {**chosen, "WRITES_HIT": writes_hit},
                     _texts(method, options, start, writes_hit), writes_hit)


def era_kernels(method: Method, options: Mapping[str, Any], any_hit: bool = False,
                defines: Mapping[str, object] | None = None) -> list[EraKernel]:
    """Return all kernels of a method in the era form, INIT first."""
    return [era_kernel(method, options, name, any_hit, defines)
            for name in (INIT, *method.kernels)]


def _texts(method: Method, options: Mapping[str, Any], start: bool,
           writes_hit: bool) -> dict[str, str]:
    layout = Precision.of(options).layout
    state, hit = layout(method.state), layout(HIT)
    reads = (RAY_TEXELS,) if start else (RAY_TEXELS, state, hit)
    streams = era_accessors.streams_glsl(reads, (state, hit) if writes_hit else (state,))
    if method.stack_entry is not None:
        streams += "\n" + era_accessors.far_stream_glsl(layout(method.stack_entry))
    tables = "\n".join(era_accessors.table_glsl(layout(record))
                       for record in method.tables_for(options))
    return {"method": f"file:{method.glsl}", "tables": tables, "streams": streams,
            **{part.name: f"file:{part.file(options)}" for part in method.parts}}


class EraTraversal(Traversal):
    """A method's kernels in the era form, under the schedule ``kernels``."""

    def __init__(self, setup: Setup) -> None:
        super().__init__(setup)
        self._repeat_tables()

    def follow(self, samplers: Samplers, accelerator: Accelerator, step_cap: int) -> None:
        """Use the tables of triangles that moved. Records and defines are unchanged."""
        super().follow(samplers, accelerator, step_cap)
        self._repeat_tables()

    def _repeat_tables(self) -> None:
        for texture in self.samplers.values():
            texture.repeat_x = True     # an accessor's coordinate exceeds 1 by the texel's row

    def uniforms(self) -> Mapping[str, Any]:
        """Return the uniforms of the accelerator and of the tables' accessors."""
        found = dict(super().uniforms())
        for record in self.method.tables_for(self.options):
            record = self.precision.layout(record)
            table = self.samplers[era_accessors.table_samplers(record)[0]]
            found.update(era_accessors.table_places(record, table.height))
        return found

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target, int]:
        """Trace every ray, as ``Traversal.run``."""
        self._buffers = buffers
        return super().run(self._generated(rays, statistics), buffers, statistics, any_hit)

    def _generated(self, rays: RayTextures, statistics: Statistics) -> RayTextures:
        """Return the rays of the traversal: no component of their directions is zero."""
        rays.complete()
        mine = self.keep("rays", lambda: rays.like(rays.size), lambda old: old.fits(rays))
        program = self.program("rays", lambda: FullScreenPass(
            self.gpu, "era/rays.frag", {}, {"streams": rays.in_textures.stream_glsl(False)}))
        self.draw(program, mine.target, rays.samplers(), statistics)
        return mine

    def _draw(self, program: FullScreenPass, rays: RayTextures, source: Target | None,
              target: Target, statistics: Statistics, depth: float = DRAWN,
              tiles: Tiles | None = None, kernel: str | None = None) -> None:
        """Draw a pass. A kernel that cannot change hits reads the hits of side 0, where each pair
        of passes ends, and writes states alone."""
        if source is None or kernel == TESTS_TRIANGLES:
            return super()._draw(program, rays, source, target, statistics, depth, tiles, kernel)
        program.set(**rays.uniforms())
        samplers = {**self.samplers, **rays.samplers(), **self._buffers.side(0).samplers(),
                    **self._states(source).samplers()}
        if self._atlas is not None:
            samplers.update(self._atlas.samplers())
            program.set(**self._atlas.uniforms)
        self.draw(program, self._states(target), samplers, statistics, kernel, depth=depth,
                  rectangles=tiles and tiles.rectangles)

    def _states(self, side: Target) -> Target:
        """Return a target over the states of a side of the buffers, without the hits."""
        buffers, record = self._buffers, self.precision.layout(self.method.state)
        index = [buffers.side(0), buffers.side(1)].index(side)
        return self.keep(
            f"states {index}",
            lambda: Target(self.gpu, record, side.size, buffers.depth,
                           borrowed={record.name: side.streams[record.name]}),
            lambda old: old.textures == side.streams[record.name])

    def _traverse(self, rays: RayTextures, any_hit: bool, steps: int, start: bool = False,
                  kernel: int = 0, hits_alone: bool = False) -> FullScreenPass:
        name = INIT if start else self.method.kernels[kernel - 1]

        def make() -> FullScreenPass:
            found = era_kernel(self.method, self.options, name, any_hit, self.accelerator.defines)
            program = FullScreenPass(self.gpu, "era/renderer.frag", found.defines, found.virtual)
            program.kernel = program.label = name
            return program
        return self.program(ProgramKey(rays.record, any_hit, 1, start, kernel, False), make)
