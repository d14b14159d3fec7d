"""The era form: a method's kernels as the cards of 2002-2006 ran them, one kernel per pass.

There are no integers: a pointer is a float or, on chips with fp24, a column and a row. Each texel
of a record lies in a separate texture. A ray's state has the fields that the paper's program
stores. The host chooses the kernel of each pass by occlusion queries.

A dialect is a main file that includes ``glsl/era/pass.glsl``, which includes the kernels of
``glsl/methods/``. The cards' compilers read the dialect ``card``; today's renderer runs the
dialect ``renderer``.
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import LimitError
from ..gl import era_accessors
from ..gl.full_screen import FullScreenPass
from ..gl.precision import Precision
from ..gl.record import Record, texels_of
from ..gl.shader import Source, resolve
from ..gl.target import Target
from ..gl.textures import TABLE_WIDTH
from ..options import word_define
from ..rays.records import HIT, RAY_TEXELS
from ..rays.textures import RayTextures, StateBuffers
from ..statistics import Statistics
from .accelerator import Accelerator
from .driver import MethodDriver, Samplers, Setup
from .live_tiles import Tiles
from .method import Method
from .schedules import DRAWN, ProgramKey, Traversal, kernel_defines

INIT = "init"     # the kernel that sets up the rays' states
# In every method with an era form, only the kernel with this name changes hits.
TESTS_TRIANGLES = "intersect"


@dataclass(frozen=True)
class EraKernel:
    """A kernel in the era form.

    Attributes
    ----------
    name : the kernel's name; INIT for the pass that sets up states
    defines, virtual : arguments of ``gl.shader.resolve``, for either dialect
    writes_hit : whether the kernel writes rays' hits
    rounding : further defines for the dialect ``renderer``, which rounds as the card does
    """

    name: str
    defines: Mapping[str, object]
    virtual: Mapping[str, str]
    writes_hit: bool
    rounding: Mapping[str, object] = field(default_factory=dict)

    def source(self, dialect: str) -> Source:
        rounding = self.rounding if dialect == "renderer" else {}
        return resolve(f"era/{dialect}.frag", {**self.defines, **rounding}, self.virtual)


def era_kernel(method: Method, options: Mapping[str, Any], name: str, any_hit: bool = False,
               defines: Mapping[str, object] | None = None, in_loop: bool = False) -> EraKernel:
    """Return a kernel of a method in the era form.

    Parameters
    ----------
    method : the method in its form for these options (`Method.formed`)
    options : the resolved options of the tracer and of the method, with ``era``
    name : a kernel of the method, or INIT
    any_hit : whether rays stop at their first hit
    defines : the accelerator's defines
    in_loop : whether the kernel is a branch in a loop, not a pass of its own
    """
    start = name == INIT
    chosen = {
        **method.defines(options), **(defines or {}), **kernel_defines(method.kernels),
        word_define("INTERSECTION", options["intersection"]): True,
        "ERA": True, "TEXEL_POINTERS": method.has_texel_pointers(options["era"]),
        "TABLE_WIDTH": float(TABLE_WIDTH),
        "ANY_HIT": any_hit, "START": start, "IN_LOOP": in_loop and not start,
        "KERNEL": None if start else name,
        "KERNEL_PHASE": None if start else method.kernels.index(name) + 1}
    writes_hit = start or name == TESTS_TRIANGLES
    return EraKernel(name, {**chosen, "WRITES_HIT": writes_hit},
                     _texts(method, options, start, writes_hit), writes_hit,
                     Precision.of(options).defines())


def era_kernels(method: Method, options: Mapping[str, Any], any_hit: bool = False,
                defines: Mapping[str, object] | None = None,
                in_loop: bool = False) -> list[EraKernel]:
    """Return all kernels of a method in the era form, INIT first."""
    return [era_kernel(method, options, name, any_hit, defines, in_loop)
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
    return {"pass": "file:era/pass.glsl", "method": f"file:{method.glsl}", "tables": tables,
            "streams": streams,
            **{part.name: f"file:{part.file(options)}" for part in method.parts}}


class EraDriver(MethodDriver):
    """A driver whose programs read tables and rays by the accessors in gl/era_accessors.py."""

    def __init__(self, setup: Setup) -> None:
        super().__init__(setup)
        self._repeat_tables()

    def follow(self, samplers: Samplers, accelerator: Accelerator, step_cap: int) -> None:
        super().follow(samplers, accelerator, step_cap)
        self._repeat_tables()

    def _repeat_tables(self) -> None:
        for texture in self.samplers.values():
            # The integer part of an accessor's x coordinate is the texel's row. If the texture
            # repeats, the sampler ignores this part.
            texture.repeat_x = True

    def uniforms(self) -> Mapping[str, Any]:
        found = dict(super().uniforms())
        for record in self.method.tables_for(self.options):
            record = self.precision.layout(record)
            table = self.samplers[era_accessors.table_samplers(record)[0]]
            found.update(era_accessors.table_places(record, table.height))
        if self.method.has_texel_pointers(self.options["era"]):
            found.update((name, tuple(texels_of(np.asarray(found[name])).tolist()))
                         for name in self.accelerator.pointers)
        return found

    def generated(self, rays: RayTextures, statistics: Statistics) -> RayTextures:
        """Return copies of the rays. A tiny number replaces components of directions near 0."""
        rays.complete()
        mine = self.keep("rays", lambda: rays.like(rays.size), lambda old: old.fits(rays))
        program = self.program("rays", lambda: FullScreenPass(
            self.gpu, "era/rays.frag", {}, {"streams": rays.in_textures.stream_glsl(False)}))
        self.draw(program, mine.target, rays.samplers(), statistics)
        return mine


class EraTraversal(EraDriver, Traversal):
    """A method's kernels in the era form, under the schedule ``kernels``."""

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target, int]:
        self._buffers, self._choices = buffers, 0
        return super().run(self.generated(rays, statistics), buffers, statistics, any_hit)

    def _classify(self, now: Target, buffers: StateBuffers, tiles: Tiles,
                  statistics: Statistics) -> dict[int, int]:
        """Do the same as ``Traversal._classify``. States have no step counts, so raise LimitError
        if the host chooses kernels more often than the step cap."""
        self._choices += 1
        if self._choices > self.step_cap:
            raise LimitError(f"method {self.method.name} in the era form does not end: the host "
                             f"has chosen {self.step_cap:,} kernels; leave era out")
        return super()._classify(now, buffers, tiles, statistics)

    def _draw(self, program: FullScreenPass, rays: RayTextures, source: Target | None,
              target: Target, statistics: Statistics, depth: float = DRAWN,
              tiles: Tiles | None = None, kernel: str | None = None) -> None:
        """Draw a pass. A kernel that cannot change hits reads hits from side 0 and writes only
        states.

        Passes are drawn in pairs, from side 0 of the buffers to side 1 and back. Before a pair,
        side 0 has the hits of all rays. These hits stay valid if the kernel cannot change hits.
        """
        if source is not None and kernel != TESTS_TRIANGLES:
            source, target = self._part(source, HIT), self._part(target)
        super()._draw(program, rays, source, target, statistics, depth, tiles, kernel)

    def _part(self, side: Target, *read: Record) -> Target:
        """Return a target with the states of a side of the buffers, and with the records ``read``
        of side 0. The target borrows all textures."""
        buffers = self._buffers
        state, *others = (self.precision.layout(record) for record in (self.method.state, *read))
        index = 0 if side is buffers.side(0) else 1
        borrowed = {state.name: side.streams[state.name],
                    **{one.name: buffers.side(0).streams[one.name] for one in others}}
        return self.keep(
            f"part {index} {len(read)}",
            lambda: Target(self.gpu, [state, *others], side.size, buffers.depth, borrowed),
            lambda old: old.textures == [one for some in borrowed.values() for one in some])

    def _traverse(self, rays: RayTextures, any_hit: bool, steps: int, start: bool = False,
                  kernel: int = 0, hits_alone: bool = False) -> FullScreenPass:
        name = INIT if start else self.method.kernels[kernel - 1]

        def make() -> FullScreenPass:
            found = era_kernel(self.method, self.options, name, any_hit, self.accelerator.defines)
            program = FullScreenPass(self.gpu, "era/renderer.frag",
                                     {**found.defines, **found.rounding}, found.virtual)
            program.kernel = program.label = name
            return program
        return self.program(ProgramKey(rays.record, any_hit, 1, start, kernel, False), make)
