"""Ray streams: each pass filters a stream of (ray, node) pairs and compacts the stream."""
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import moderngl

from ...gl.algorithms.records import VALUES
from ...gl.algorithms.scan import scan
from ...gl.algorithms.streams import Stream, StreamRoom, span
from ...gl.full_screen import FullScreenPass, Rectangles
from ...gl.record import EXACT_INTEGER, Record, streams_glsl
from ...gl.target import Target
from ...gl.textures import bytes_of, release
from ...rays.records import COUNTERS, HIT, NO_TRIANGLE
from ...rays.textures import RayTextures, StateBuffers
from ...statistics import Statistics
from ...traversal.driver import MethodDriver, Samplers, Setup
from ...traversal.records import LEAST, LOWEST, TESTED
from ...traversal.schedules import method_defines, method_texts
from .records import MET, QUEUED, TALLY, VISITED

NEAR, FAR, LEAF = "xyz"   # channels of a filtered stream's flags


class RayStreams(MethodDriver):
    """Runs `bvh-packet` with the option ``streams``.

    An element is a pair of a ray and a node. The waiting elements form a stream, used as a stack.
    A pass pops the last ``stream_size`` elements and tests both children of each element's node.
    It pushes far children first, so that near children are popped first. At leaves, rays test
    triangles. If too few elements wait, further rays start at the root.

    The stream has space for ``stream_size`` elements per level of the tree, because each pass
    replaces popped elements by elements one level deeper.

    Attributes
    ----------
    lengths : the number of elements in each filter pass of the last run
    """

    def __init__(self, setup: Setup) -> None:
        super().__init__(setup)
        self.tallied = self.statistics_on or setup.options["step_cap"] is not None
        self.room = self.kept["room"] = StreamRoom(setup.gpu, "methods/bvh")
        self._rectangles = self.kept["rectangles"] = Rectangles(setup.gpu, 3)
        self.lengths: list[int] = []
        self._streams: dict[str, Stream] = {}
        self._targets: dict[tuple[str, ...], Target] = {}
        self._images: dict[str, Target] = {}
        self._size: tuple[int, int] | None = None

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target, int]:
        context, drawn = self.gpu.context, self.room.draws
        context.enable_only(moderngl.NOTHING)
        context.blend_func = moderngl.ONE, moderngl.ONE
        self._make_room(buffers.size)
        begun, final = buffers.side(0), buffers.side(1)
        hits = begun.part(self.precision.layout(HIT))
        try:
            self._over_rays(rays, None, begun, any_hit)
            self._filter_all(rays, hits, any_hit)
            self._over_rays(rays, hits, final, any_hit)
            stopped = (self.count_stopped(final, buffers, statistics) if self.tallied else 0)
        finally:
            hits.release()
            context.enable_only(moderngl.NOTHING)
            context.blend_equation = moderngl.FUNC_ADD
        statistics.passes += 2 + len(self.lengths)
        statistics.draw_calls += self.room.draws - drawn
        statistics.driver.update(streams=len(self.lengths), elements=sum(self.lengths))
        return final, stopped

    # Passes ---------------------------------------------------------------------------------

    def _filter_all(self, rays: RayTextures, hits: Target, any_hit: bool) -> None:
        """Start rays and filter elements until no element waits and every ray has started."""
        self.lengths = []
        if not self.accelerator.uniforms["node_count"]:
            return
        count, begun, waiting = rays.size[0] * rays.size[1], 0, 0
        size = self._stream_size(count)
        while waiting or begun < count:
            if waiting < size and begun < count:
                some = min(size - waiting, count - begun)
                self._draw("stream_start", ("queued",), [rays.record], rays.samplers(), waiting,
                           some, base=waiting, first_ray=begun, width=rays.size[0],
                           root=self.accelerator.uniforms["root"], **rays.uniforms())
                begun, waiting = begun + some, waiting + some
            taken = min(size, waiting)
            waiting += self._filter(rays, hits, waiting - taken, taken, any_hit) - taken

    def _filter(self, rays: RayTextures, hits: Target, first: int, count: int,
                any_hit: bool) -> int:
        """Replace the last ``count`` elements. Return the number of elements that replace them."""
        self.lengths.append(count)
        tally = [TALLY] if self.tallied else []
        self._draw("stream_visit", ("visited", "values"),
                   [rays.record, hits.record, QUEUED, *tally],
                   {**rays.samplers(), **hits.samplers(), **self._streams["queued"].samplers(),
                    **(self._images["tally"].samplers() if tally else {})},
                   0, count, any_hit, base=first, **rays.uniforms())
        visited, flags = self._streams["visited"], self._streams["values"].called("values")
        flags.length = count
        if self.tallied:
            self._tally([visited, flags], count)
        sums = scan(self.room, flags)
        near, far, leaves = (int(n) for n in sums.read_one(count)["value"][:3])
        self._gather(sums, FAR, self._streams["queued"], first, far)
        self._gather(sums, NEAR, self._streams["queued"], first + far, near)
        self._gather(sums, LEAF, self._streams["leaves"], 0, leaves)
        self.room.drop(sums)
        if leaves:
            self._test_leaves(rays, hits, leaves, any_hit)
        return near + far

    def _gather(self, sums: Stream, flag: str, target: Stream, first: int, count: int) -> None:
        """Copy the elements with ``flag`` to ``target``, where they begin at element ``first``."""
        self.room.draw("stream_take", target, [self._streams["visited"], sums],
                       first=first, count=count, defines={"FLAG": flag, "FAR": flag == FAR},
                       base=first, elements=sums.length - 1)

    def _test_leaves(self, rays: RayTextures, hits: Target, count: int, any_hit: bool) -> None:
        """Test triangles of leaves. Keep each ray's nearest hit; for equal t, the lowest index."""
        self._draw("stream_leaves", ("tested", "met"), [rays.record, hits.record, QUEUED],
                   {**rays.samplers(), **hits.samplers(),
                    **self._streams["leaves"].called("queued").samplers()},
                   0, count, any_hit, **rays.uniforms())
        tested, met = self._streams["tested"], self._streams["met"]
        least, lowest = self._images["least"], self._images["lowest"]
        least.clear(math.inf)
        lowest.clear(NO_TRIANGLE)
        self._blend((moderngl.MIN, moderngl.FUNC_ADD))
        self._scatter("drivers/nearest", least, [tested], count)
        self._blend(moderngl.MIN)
        self._scatter("drivers/nearest", lowest, [tested, least], count, "LOWEST")
        self.gpu.context.enable_only(moderngl.NOTHING)
        # The triangle test has already rounded the values to the storage format.
        target = hits.part(replace(hits.record, storage="fp32"))
        self._scatter("drivers/nearest", target, [tested, met, least, lowest], count, "HITS")
        target.release()
        if self.tallied:
            self._tally([tested, met], count, "LEAVES")

    def _tally(self, reads: Sequence[Stream], count: int, word: str | None = None) -> None:
        self._blend(moderngl.FUNC_ADD)
        self._scatter("stream_tally", self._images["tally"], reads, count, word)
        self.gpu.context.enable_only(moderngl.NOTHING)

    def _scatter(self, program: str, target: Target, reads: Sequence[Target],
                 count: int, word: str | None = None) -> None:
        """Draw a point for each element at its ray's texel."""
        self.room.scatter(program, target, reads, count,
                          defines={word: True} if word else {}, size=target.size)

    def _blend(self, equation: int | tuple[int, int]) -> None:
        self.gpu.context.enable_only(moderngl.BLEND)
        self.gpu.context.blend_equation = equation

    def _draw(self, name: str, targets: tuple[str, ...], reads: list[Record], textures: Samplers,
              first: int, count: int, any_hit: bool = False, **uniforms: object) -> None:
        """Draw a program over the target streams' elements ``first`` to ``first + count - 1``."""
        streams = [self._streams[target] for target in targets]
        program = self._program(f"methods/bvh/{name}", reads,
                                [stream.record for stream in streams], any_hit)
        program.set(last_element=first + count - 1, **uniforms)
        self._rectangles.write(span(first, count))
        if targets not in self._targets:
            self._targets[targets] = Target(
                self.gpu, [stream.record for stream in streams], streams[0].size,
                borrowed={stream.record.name: stream.textures for stream in streams})
        program.draw(self._targets[targets], {**self.samplers, **textures},
                     rectangles=self._rectangles)
        self.room.draws += 1

    def _over_rays(self, rays: RayTextures, hits: Target | None, target: Target,
                   any_hit: bool) -> None:
        """Draw a pass over all rays: start them if ``hits`` is None, else write their hits."""
        reads = [rays.record] if hits is None else [TALLY] if self.tallied else []
        layout = self.precision.layout
        writes = [layout(self.method.state), layout(HIT)]
        writes += [COUNTERS] if self.statistics_on else []
        program = self._program("methods/bvh/stream_rays", reads,
                                writes, any_hit, START=hits is None)
        program.set(**rays.uniforms())
        textures = {**rays.samplers(), **(hits.samplers() if hits is not None else {})}
        for image in self._images.values():
            textures |= image.samplers()
        program.draw(target, textures)
        self.room.draws += 1

    # Programs and textures ------------------------------------------------------------------

    def _program(self, name: str, reads: list[Record], writes: list[Record], any_hit: bool = False,
                 **defines: object) -> FullScreenPass:
        def make() -> FullScreenPass:
            counts = self.statistics_on and COUNTERS in writes
            return FullScreenPass(
                self.gpu, f"{name}.frag",
                {**method_defines(self.method, self.accelerator, self.options, any_hit),
                 **defines, "TALLIED": self.tallied, "STATISTICS": counts},
                {**method_texts(self.method, self.options),
                 "streams": streams_glsl(reads, writes)})
        return self.program((name, tuple(reads), tuple(writes), any_hit,
                             tuple(sorted(defines.items()))), make)

    def _stream_size(self, rays: int) -> int:
        """Return the largest number of stream elements in a pass, for ``rays`` rays."""
        levels = self.accelerator.stack_levels + 3
        nodes = int(self.accelerator.uniforms["node_count"]) + 1
        return min(self.options["stream_size"], EXACT_INTEGER // levels, rays * nodes)

    def _make_room(self, size: tuple[int, int]) -> None:
        if self._size == size:
            if self.tallied:
                self._images["tally"].clear()
            return
        self._release_room()
        length = self._stream_size(size[0] * size[1])
        levels = self.accelerator.stack_levels + 3
        nodes = int(self.accelerator.uniforms["node_count"]) + 1
        waiting = min(length * levels, size[0] * size[1] * nodes)
        for name, record, elements in (
                ("queued", QUEUED, max(waiting, length)), ("leaves", QUEUED, length),
                ("visited", VISITED, length), ("values", VALUES, length),
                ("tested", TESTED, length), ("met", MET, length)):
            self._streams[name] = self.room.stream(record, elements)
        images = [LEAST, LOWEST, *([TALLY] if self.tallied else [])]
        self._images = {record.name: Target(self.gpu, record, size) for record in images}
        self._size = size       # last: now every texture exists
        if self.tallied:
            self._images["tally"].clear()

    def bytes(self) -> int:
        return super().bytes() + bytes_of(self._images)

    def _release_room(self) -> None:
        release(self._targets, self._images)
        self.room.drop(*self._streams.values())
        self._targets, self._images, self._streams, self._size = {}, {}, {}, None

    def release(self) -> None:
        self._release_room()
        super().release()
