"""Sorted rays: sorts the rays before any driver traces them.

Hachisuka's survey proposes sorting (section 4.3) without measuring it. A ray's key joins two
cells: where the ray begins, and where it leaves the scene (``glsl/stages/sort_keys.frag``). The
sorted rays fill squares of 8x8 texels, so packets and tiles hold coherent rays. Hits are then
written back in the caller's order.
"""
from __future__ import annotations

import time

import moderngl
import numpy as np

from ...gl.algorithms.records import SORT_KEY, VALUES
from ...gl.algorithms.reduce import reduce_stream
from ...gl.algorithms.sort import sort
from ...gl.algorithms.streams import Stream, StreamRoom
from ...gl.full_screen import FullScreenPass
from ...gl.primitive_pass import PrimitivePass
from ...gl.record import TABLE_WIDTH_LOG2, Record, streams_glsl
from ...gl.target import Target
from ...rays.order import SQUARE, squares
from ...rays.records import COUNTERS, HIT
from ...rays.textures import RayTextures, StateBuffers
from ...statistics import Statistics
from ..accelerator import Accelerator
from ..driver import MethodDriver, Samplers

# LEVELS: bits per axis and cell. A key interleaves the bits of its two cells, coarse levels first.
# FREE_LEVELS: number of levels at the start of a key that come from the origin's cell alone.
KEY = {"LEVELS": 8, "FREE_LEVELS": 2}


class SortedRays(MethodDriver):
    """Runs another driver on rays in the order of their keys."""

    def follow(self, samplers: Samplers, accelerator: Accelerator, step_cap: int) -> None:
        super().follow(samplers, accelerator, step_cap)
        self.driver.follow(samplers, accelerator, step_cap)

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target, int]:
        began = time.perf_counter()
        with StreamRoom(self.gpu) as room:
            keys = self._sorted_keys(room, rays)
            there, aside = self._sorted_rays(rays)
            self._gather(keys, rays, there)
            self.gpu.finish()
            sorted_at = time.perf_counter()
            side, stopped = self.driver.run(there, aside, statistics, any_hit)
            self.gpu.finish()
            traced = time.perf_counter()
            final = buffers.side(0)
            self._bring_back(keys, side.samplers(), rays, final)
            self.gpu.finish()
        statistics.sort_seconds += (sorted_at - began) + (time.perf_counter() - traced)
        return final, stopped

    def order(self, rays: RayTextures) -> np.ndarray:
        """Return the indices of the rays in sorted order, (n,) int32. Every 64 consecutive rays
        fill a square of texels."""
        with self.gpu, StreamRoom(self.gpu) as room:
            return self._sorted_keys(room, rays).read()["index"]

    # Passes ---------------------------------------------------------------------------------

    def _sorted_keys(self, room: StreamRoom, rays: RayTextures) -> Stream:
        count = rays.size[0] * rays.size[1]
        corners = []
        for minus, name in ((False, "low"), (True, "high")):
            origins = room.stream(VALUES, count)
            self._draw("sort_bounds", origins, rays, {"MINUS": minus})
            corners.append(reduce_stream(room, origins, "min").called(name))
        keys = room.stream(SORT_KEY, count)
        self._draw("sort_keys", keys, rays, KEY, corners)
        return sort(room, keys)

    def _draw(self, name: str, target: Stream, rays: RayTextures, defines: dict[str, object],
              reads: list[Stream] | None = None) -> None:
        reads = reads or []
        program = self._compiled(name, rays.record, [read.record for read in reads],
                                 target.record, defines)
        program.set(last_element=target.length - 1, ray_texture_size=rays.size, **rays.uniforms())
        samplers = rays.samplers()
        for read in reads:
            samplers |= read.samplers()
        program.draw(target, samplers)

    def _gather(self, keys: Stream, rays: RayTextures, there: RayTextures) -> None:
        program = self._compiled("sort_gather", None, [SORT_KEY], rays.record, {})
        program.set(ray_texture_size=rays.size, squares_a_row=there.size[0] // SQUARE,
                    elements=keys.length, **rays.uniforms())
        program.draw(there.target, {**rays.samplers(), **keys.samplers()})

    def _bring_back(self, keys: Stream, samplers: Samplers, rays: RayTextures,
                    final: Target) -> None:
        def make() -> PrimitivePass:
            writes = (self.precision.layout(self.method.state), self.precision.layout(HIT),
                      *([COUNTERS] if self.statistics_on else []))
            return PrimitivePass(
                self.gpu, "stages/sort_scatter.frag", "stages/sort_scatter.vert",
                {**self.precision.defines(), "STATISTICS": self.statistics_on},
                {"streams": streams_glsl((), writes), "sources": _with_width(SORT_KEY)})
        scatter = self.program("sort_scatter", make)
        scatter.set(ray_texture_size=rays.size,
                    squares_a_row=squares(rays.size[0] * rays.size[1])[0])
        self.gpu.context.enable_only(moderngl.NOTHING)
        scatter.draw(final, {**samplers, **keys.samplers()}, moderngl.POINTS, keys.length)

    # Programs and textures ------------------------------------------------------------------

    def _compiled(self, name: str, rays: Record | None, reads: list[Record], writes: Record,
                  defines: dict[str, object]) -> FullScreenPass:
        texts = [record.stream_glsl(False) for record in ([rays] if rays else []) + reads]
        return self.program((name, rays, writes, tuple(defines.items())), lambda: FullScreenPass(
            self.gpu, f"stages/{name}.frag",
            {**self.precision.defines(), **defines, "TABLE_WIDTH_LOG2": TABLE_WIDTH_LOG2},
            {"streams": "\n".join([*texts, writes.stream_glsl(True)])}))

    def _sorted_rays(self, rays: RayTextures) -> tuple[RayTextures, StateBuffers]:
        across, down = squares(rays.size[0] * rays.size[1])
        size = (SQUARE * across, SQUARE * down)
        found, buffers = self.keep("sorted", lambda: (rays.like(size), StateBuffers(
            self.gpu, self.method.state, size, self.statistics_on, self.precision)),
            lambda part: part[0].fits(rays, size))
        found.share_with(rays)
        return found, buffers


def _with_width(record: Record) -> str:
    return f"#define TABLE_WIDTH_LOG2 {TABLE_WIDTH_LOG2}\n" + record.stream_glsl(False)
