"""The three schedules: how a host runs a method's kernels over the rays.

* ``kernels``: A pass runs one kernel. Occlusion queries count the rays that wait for each kernel.
  The host runs the kernel with the most rays, and the early depth test rejects all other rays
  (Purcell et al. 2002; Foley and Sugerman 2005).
* ``step``: A pass does ``steps_per_pass`` steps for every live ray. Each step runs the kernel that
  the ray's state asks for. Every ``mask_interval`` passes, finished rays are masked.
* ``loop``: One pass runs the whole traversal in registers, and writes only hits (Horn et al.
  2007). If a ray exceeds the renderer's limit on loop iterations, passes that store states trace
  all rays anew.
"""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import moderngl
import numpy as np

from .. import hits
from ..errors import MethodError
from ..gl.full_screen import FullScreenPass
from ..gl.precision import Precision
from ..gl.record import TABLE_WIDTH_LOG2, Record, streams_glsl
from ..gl.target import Target
from ..options import word_define
from ..rays.records import COUNTERS, HIT
from ..rays.textures import RayTextures, StateBuffers
from ..statistics import Statistics
from .accelerator import Accelerator
from .driver import DONE, DRAWN, OVERFLOWN, UNFINISHED, MethodDriver, Samplers
from .live_tiles import Tiles
from .method import Method
from .records import ENTRIES, ENTRY_LIST, ENTRY_TILE, PACKET_ENTRY
from .stack_atlas import StackAtlas

# llvmpipe ends a shader's loops silently after 65,535 iterations. So a pass stops a ray after this
# smaller number of steps, and the next pass continues the ray. Silent ends are then rare.
LOOP_STEPS = 60_000

# Count the rays of each tile again when the live rays fall below this share of the last count.
FEWER = 0.7
MASKED = 0.0    # depth of a masked ray


def kernel_depth(kernel: int) -> float:
    """Return the depth that marks the rays waiting for a kernel; kernels are numbered from 1."""
    return (1 + kernel) / 16


def mark_stopped(status: np.ndarray, phases: np.ndarray) -> None:
    """Write the status codes of stopped rays, by their ``phases``."""
    status[phases == UNFINISHED] = hits.UNFINISHED
    status[phases == OVERFLOWN] = hits.STACK_OVERFLOW


class ProgramKey(NamedTuple):
    """The key that distinguishes a method's traversal programs."""

    rays: Record
    any_hit: bool
    steps: int
    start: bool
    kernel: int   # the only kernel of the program, or 0 for all kernels
    hits_alone: bool   # whether the program writes no states


class Traversal(MethodDriver):
    """A method's programs for one set of tables and options, under any schedule."""

    keeps_states = True
    _atlas: StackAtlas | None = None
    _overran = False    # whether a ray under `loop` did not end within one pass

    def follow(self, samplers: Samplers, accelerator: Accelerator, step_cap: int) -> None:
        super().follow(samplers, accelerator, step_cap)
        self._overran = False

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target, int]:
        """Trace every ray.

        Returns
        -------
        (Target, int)
            the buffer with the hits and, unless the traversal ran in registers, the final states;
            and the number of rays that were stopped early.
        """
        schedule = {"kernels": self._run_kernels, "step": self._run_step, "loop": self._run_loop}
        context = self.gpu.context
        self._atlas = self._atlas_for(buffers.size)
        try:
            return schedule[str(self.options["schedule"])](rays, buffers, statistics, any_hit)
        finally:
            context.enable_only(moderngl.NOTHING)
            context.depth_func = "<"

    # Schedules ------------------------------------------------------------------------------

    def _run_loop(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
                  any_hit: bool) -> tuple[Target, int]:
        self.gpu.context.enable_only(moderngl.NOTHING)
        # Counters and observers need states in textures.
        in_textures = self.statistics_on or self._overran or self.gpu.observers.states
        if not in_textures and self._finish_all(rays, buffers, statistics, any_hit):
            return buffers.side(0), 0
        buffers.write_states()
        now = buffers.side(0)
        self._draw(self._traverse(rays, any_hit, LOOP_STEPS, start=True), rays, None, now,
                   statistics)
        live, stopped = self._live(now, buffers, statistics)
        side = 0
        while live:
            side = 1 - side
            now, before = buffers.side(side), now
            self._draw(self._traverse(rays, any_hit, LOOP_STEPS), rays, before, now, statistics)
            live, stopped = self._live(now, buffers, statistics)
        return now, stopped

    def _finish_all(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
                    any_hit: bool) -> bool:
        """Trace every ray in registers. Return whether the traversal of every ray ended.

        The program discards rays that do not end; an occlusion query counts the other rays.
        """
        query = self.gpu.query()
        with query:
            self._draw(self._traverse(rays, any_hit, LOOP_STEPS, start=True, hits_alone=True),
                       rays, None, buffers.hits(), statistics)
        statistics.queries += 1
        self._overran = query.samples < rays.size[0] * rays.size[1]
        return not self._overran

    def _run_step(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
                  any_hit: bool) -> tuple[Target, int]:
        steps = self.options["steps_per_pass"]
        interval = self.mask_interval
        program = self._traverse(rays, any_hit, steps)
        mask = self.state_program("mask", self.method.state)
        before, now = buffers.side(1), buffers.side(0)
        tiles = self._tiles_for(buffers)
        self._clear_depth(buffers)
        self._draw(self._traverse(rays, any_hit, 0, start=True), rays, None, now, statistics)
        live = counted = rays.size[0] * rays.size[1]
        while live > 0:
            self.gpu.context.enable_only(moderngl.DEPTH_TEST)
            for _ in range(interval):
                before, now = now, before
                self._draw(program, rays, before, now, statistics, DRAWN, tiles)
                self._push(now, tiles, statistics)
            live -= mask.count(buffers.mask, before.samplers(), statistics, MASKED,
                               tiles.rectangles)
            statistics.live.append(live)
            if live < FEWER * counted:
                tiles.count(before.samplers())
                tiles.choose(None)
                statistics.draw_calls += 1
                counted = live
        return now, self.count_stopped(now, buffers, statistics)

    def _run_kernels(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
                     any_hit: bool) -> tuple[Target, int]:
        context = self.gpu.context
        # Passes are drawn in pairs, from ``now`` to ``scratch`` and back. Between pairs, only
        # ``now`` holds the latest state of every ray.
        now, scratch = buffers.side(0), buffers.side(1)
        tiles = self._tiles_for(buffers)
        context.enable_only(moderngl.NOTHING)
        self._draw(self._traverse(rays, any_hit, 0, start=True), rays, None, now, statistics)
        while True:
            waiting = self._classify(now, buffers, tiles, statistics)
            statistics.live.append(sum(waiting.values()))
            kernel = max(waiting, key=waiting.__getitem__)
            if not waiting[kernel]:
                return now, self.count_stopped(now, buffers, statistics)
            name = self.method.kernels[kernel - 1]
            program = self._traverse(rays, any_hit, 1, kernel=kernel)
            pairs = max(1, self.mask_interval // 2)
            tiles.choose(kernel)
            if name == "push":
                self._push(now, tiles, statistics)
            context.depth_func = "=="
            for _ in range(pairs):
                for source, target in ((now, scratch), (scratch, now)):
                    self._draw(program, rays, source, target, statistics, kernel_depth(kernel),
                               tiles, name)

    # Parts of the schedules -----------------------------------------------------------------

    def _draw(self, program: FullScreenPass, rays: RayTextures,
              source: Target | None, target: Target, statistics: Statistics,
              depth: float = DRAWN, tiles: Tiles | None = None,
              kernel: str | None = None) -> None:
        program.set(**rays.uniforms())
        samplers = {**self.samplers, **rays.samplers(), **(source.samplers() if source else {})}
        if self._atlas is not None:
            samplers.update(self._atlas.samplers())
            program.set(**self._atlas.uniforms)
        if len(program.uniforms) < len(program.reads):
            unset = ", ".join(sorted(set(program.reads) - set(program.uniforms)))
            raise MethodError(f"{self.method.glsl} reads the uniform {unset}, which has no value; "
                              "return the value in the uniforms of the method's prepare")
        self.draw(program, target, samplers, statistics, kernel, depth=depth,
                  rectangles=tiles and tiles.rectangles)

    def _push(self, now: Target, tiles: Tiles, statistics: Statistics) -> None:
        """Push the entries of rays in phase PUSH into the atlas, if there is an atlas."""
        if self._atlas is not None:
            self._atlas.push(now.samplers(), tiles.rectangles)
            statistics.draw_calls += 1

    def _classify(self, now: Target, buffers: StateBuffers, tiles: Tiles,
                  statistics: Statistics) -> dict[int, int]:
        """Return the number of rays that wait for each kernel, and mark each ray by its depth."""
        tiles.choose(None)
        tiles.count(now.samplers())
        self._clear_depth(buffers)
        program = self.state_program("classify", self.method.state)
        queries = {}
        for kernel in range(1, len(self.method.kernels) + 1):
            tiles.choose(kernel)
            program.set(phase=kernel)
            queries[kernel] = self.gpu.query()
            with queries[kernel]:
                program.draw(buffers.mask, now.samplers(), kernel_depth(kernel), tiles.rectangles)
        statistics.draw_calls += 1 + len(queries)
        statistics.queries += len(queries)
        return {kernel: query.samples for kernel, query in queries.items()}

    def _live(self, now: Target, buffers: StateBuffers,
              statistics: Statistics) -> tuple[int, int]:
        """Return the numbers of unfinished and of stopped rays."""
        rays = buffers.size[0] * buffers.size[1]
        done = self.count_phase(DONE, now, buffers, statistics)
        if done == rays:   # the usual case, which needs a single query
            return 0, 0
        stopped = self.count_stopped(now, buffers, statistics)
        return rays - done - stopped, stopped

    def _clear_depth(self, buffers: StateBuffers) -> None:
        self.gpu.context.depth_func = "<"
        self.gpu.clear(buffers.mask, depth=1.0)

    def _tiles_for(self, buffers: StateBuffers) -> Tiles:
        tiles = self.keep(
            "tiles", lambda: Tiles(self.gpu, buffers.size, self._state_glsl()),
            lambda tiles: tiles.size == buffers.size)
        tiles.everywhere()
        return tiles

    def _atlas_for(self, size: tuple[int, int]) -> StackAtlas | None:
        entry = self.method.stack_entry
        return None if entry is None else self.keep("atlas", lambda: StackAtlas(
            self.gpu, entry, self.precision.layout(self.method.state),
            self.accelerator.stack_levels, size, self.precision,
            kernel_defines(self.method.kernels)), lambda atlas: atlas.size == size)

    # Programs -------------------------------------------------------------------------------

    def _traverse(self, rays: RayTextures, any_hit: bool, steps: int, start: bool = False,
                  kernel: int = 0, hits_alone: bool = False) -> FullScreenPass:
        def make() -> FullScreenPass:
            defines = {
                **method_defines(self.method, self.accelerator, self.options, any_hit),
                **kernel_defines(self.method.kernels),
                "START": start, "ONLY_KERNEL": kernel or None,
                "SINGLE_STEP": steps == 1, "MANY_STEPS": steps > 1}
            virtual = {**method_texts(self.method, self.options),
                       "streams": self._streams_glsl(rays.record, hits_alone),
                       "states": "file:drivers/states_in_"
                       + ("registers" if hits_alone else "textures") + ".glsl"}
            program = FullScreenPass(self.gpu, "drivers/traverse.frag", defines, virtual)
            program.set(steps_per_pass=steps)
            program.kernel = "init" if start and not steps else "all"
            if kernel:
                program.kernel = program.label = self.method.kernels[kernel - 1]
            return program
        return self.program(ProgramKey(rays.record, any_hit, steps, start, kernel, hits_alone),
                            make)

    def _streams_glsl(self, rays: Record, hits_alone: bool) -> str:
        layout = self.precision.layout
        if hits_alone:
            return streams_glsl((rays,), (layout(HIT),), (layout(self.method.state),))
        entry = self.method.stack_entry
        return streams_glsl((rays, *([layout(entry)] if entry is not None else [])),
                            (layout(self.method.state), layout(HIT),
                             *([COUNTERS] if self.statistics_on else [])))

    def _state_glsl(self) -> str:
        return self.precision.layout(self.method.state).stream_glsl(writes=False)


def method_defines(method: Method, accelerator: Accelerator, options: Mapping[str, Any],
                   any_hit: bool) -> dict[str, object]:
    return {**method.defines(options), **accelerator.defines, **Precision.of(options).defines(),
            "ANY_HIT": any_hit, "STATISTICS": bool(options["statistics"]),
            "TABLE_WIDTH_LOG2": TABLE_WIDTH_LOG2, "SMALL_INTEGERS": accelerator.small_integers,
            word_define("INTERSECTION", options["intersection"]): True}


def method_texts(method: Method, options: Mapping[str, Any]) -> dict[str, str]:
    """Return the texts that programs include, by the include's name: the method's file, the files
    that options choose, and the accessors of the tables."""
    layout = Precision.of(options).layout
    tables = [layout(r).table_glsl() for r in method.tables_for(options)]
    if options.get("entry_points") and method.packet:
        tables += [f"#define ENTRY_TILE {options['entry_points']}",
                   PACKET_ENTRY.stream_glsl(writes=False)]
    elif options.get("entry_points"):
        tables += [f"#define ENTRY_TILE {ENTRY_TILE}", f"const int ENTRIES = {ENTRIES};",
                   ENTRY_LIST.stream_glsl(writes=False)]
    return {"method": f"file:{method.glsl}", "tables": "\n".join(tables),
            **{part.name: f"file:{part.file(options)}" for part in method.parts}}


def kernel_defines(kernels: tuple[str, ...]) -> dict[str, object]:
    """Return the defines that number a method's kernels.

    ``DOWN 1`` is the phase of the kernel ``down``, and ``EACH_KERNEL(F)`` expands to
    ``F(1, down) F(2, intersect)`` and so on.
    """
    numbered = list(enumerate(kernels, 1))
    return {**{kernel.upper(): number for number, kernel in numbered},
            "EACH_KERNEL(F)": " ".join(f"F({number}, {kernel})" for number, kernel in numbered)}
