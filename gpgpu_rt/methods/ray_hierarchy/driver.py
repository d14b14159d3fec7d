"""The driver of `ray-hierarchy`: pairs of a triangle and a node descend a hierarchy of rays."""
from __future__ import annotations

import math
from collections.abc import Mapping

import moderngl

from ...gl.algorithms.blocks import reduce_children
from ...gl.algorithms.records import VALUES
from ...gl.algorithms.streams import Stream, StreamRoom, span
from ...gl.full_screen import FullScreenPass, Rectangles
from ...gl.record import Record
from ...gl.target import Target
from ...rays.records import COUNTERS, HIT, NO_TRIANGLE
from ...rays.textures import RayTextures, StateBuffers
from ...statistics import Statistics
from ...traversal.accelerator import Accelerator
from ...traversal.driver import MethodDriver, Samplers, Setup
from ...traversal.records import LEAST, LOWEST, TESTED
from ...traversal.schedules import kernel_defines, method_defines, method_texts
from .cones import RayCones
from .records import CHILDREN, PAIR, VISITS

GROWTH = 4      # ratio of the sizes of successive batches of triangles


class RayHierarchy(MethodDriver):
    """Runs `ray-hierarchy`.

    Before each batch of triangles, the hierarchy is rebuilt over the rays, which end at their
    nearest hits so far. The first batches are small: their hits shorten the rays of later batches.
    A batch begins with all pairs of its triangles and the nodes of the top level. A pass tests the
    triangles of up to ``stream_size`` pairs against the four children of the pairs' nodes. A child
    that a triangle may hit forms a new pair. The new pairs descend to the rays before the next
    pairs are tested, so no stream is longer than four times ``stream_size``.
    """

    def __init__(self, setup: Setup) -> None:
        super().__init__(setup)
        self.room = self.kept["room"] = StreamRoom(setup.gpu, "methods/ray_hierarchy")
        self._rectangles = self.kept["rectangles"] = Rectangles(setup.gpu, 3)
        self.cones: RayCones | None = None
        self._images: list[Target] = []
        self._visits: list[Target] = []
        self._pairs: dict[int, Stream] = {}
        self._streams: dict[str, Stream] = {}
        self._balls: Stream | None = None

    @property
    def unit(self) -> float:
        """The factor by which passes scale lengths; see `rows.unit_of`."""
        return self.accelerator.uniforms["unit"]

    @property
    def triangles(self) -> int:
        """The number of triangles in the scene."""
        return self.accelerator.step_bound

    def follow(self, samplers: Samplers, accelerator: Accelerator, step_cap: int) -> None:
        """Use new tables after the triangles moved."""
        super().follow(samplers, accelerator, step_cap)
        if self._balls is not None:
            self.room.drop(self._balls)
            self._balls = None

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target, int]:
        self.gpu.context.enable_only(moderngl.NOTHING)
        self.gpu.context.blend_func = moderngl.ONE, moderngl.ONE
        drawn = self.room.draws
        try:
            self._targets_for(buffers.size)
            trace = _Trace(self, rays, buffers, statistics, any_hit)
            trace.run()
            stopped = self.count_stopped(trace.now, buffers, statistics)
        finally:
            self.gpu.context.enable_only(moderngl.NOTHING)
            self.gpu.context.blend_equation = moderngl.FUNC_ADD
        statistics.draw_calls += self.room.draws - drawn
        return trace.now, stopped

    # Passes ---------------------------------------------------------------------------------

    def _draw(self, program: FullScreenPass, rays: RayTextures, source: Target | None,
              target: Target, statistics: Statistics) -> None:
        textures = {**self.samplers, **rays.samplers(), **(source.samplers() if source else {})}
        for image in self._images + self._visits[:1]:
            textures |= image.samplers()
        program.set(**rays.uniforms())
        if self.cones is not None:
            program.set(fan=self.cones.fans[0])
        self.draw(program, target, textures, statistics)

    def _test(self, level: int, first: int, count: int) -> int:
        """Test the triangles of pairs against the children of the pairs' nodes.

        Return the number of pairs that remain, one level below.
        """
        assert self.cones is not None and self._balls is not None
        pairs, below = self._pairs[level], self.cones.levels[level - 1]
        children = self.stream(CHILDREN, count)
        self.room.draw("pair_children", children, [pairs, below, self._balls],
                       count=count, defines=self.precision.defines(), base=first, unit=self.unit,
                       fan=self.cones.fans[level - 1], below=below.size)
        if self.statistics_on:
            self._count(level, first, count)
        self._pairs[level - 1], kept = reduce_children(self.room, children, count, PAIR,
                                                       self._pairs.get(level - 1))
        return kept

    def _count(self, level: int, first: int, count: int) -> None:
        """Add a visit to each pair's node. `hand_down_visits` later passes it on to children."""
        visits = self._visits[level - 1]
        self.blend(moderngl.FUNC_ADD)
        self.room.scatter("pair_visits", visits, [self._pairs[level]], count, base=first,
                          size=visits.size)
        self.gpu.context.enable_only(moderngl.NOTHING)

    def hand_down_visits(self) -> None:
        """Add each node's visits to its children, down to the first level above the rays."""
        assert self.cones is not None
        self.blend(moderngl.FUNC_ADD)
        for level in range(len(self._visits) - 1, 0, -1):
            above, below = self._visits[level], self._visits[level - 1]
            program = self.compiled("methods/ray_hierarchy/visits_below", [(VISITS, True)], {
                "above": VISITS.stream_glsl(False).replace("visits", "above").replace(
                    "Visits", "Above")})
            program.set(fan=self.cones.fans[level])
            program.draw(below, above.samplers("above"))
            self.room.draws += 1
        self.gpu.context.enable_only(moderngl.NOTHING)

    def nearest_of(self, pairs: int, first: int, rays: RayTextures, before: Target,
                   any_hit: bool) -> None:
        """Test ``pairs`` pairs of ray and triangle, from ``first`` on.

        Keep each ray's least t, and the lowest index of the triangles at this t.
        """
        nearest, lowest = self._images
        candidates = self.stream(TESTED, pairs)
        program = self.compiled("methods/ray_hierarchy/pair_hits", [
            (rays.record, False), (self.precision.layout(HIT), False), (PAIR, False),
            (TESTED, True)], {}, any_hit, STATISTICS=False)
        program.set(base=first, last_element=pairs - 1, **rays.uniforms())
        self._rectangles.write(span(0, pairs))
        program.draw(candidates, {
            **self.samplers, **rays.samplers(), **before.samplers(), **self._pairs[0].samplers()},
            rectangles=self._rectangles)
        nearest.clear(math.inf)
        lowest.clear(NO_TRIANGLE)
        self.blend((moderngl.MIN, moderngl.FUNC_ADD))
        self.room.scatter("drivers/nearest", nearest,
                          [candidates], pairs, size=nearest.size)
        self.blend(moderngl.MIN)
        self.room.scatter("drivers/nearest", lowest, [candidates, nearest], pairs,
                          defines={"LOWEST": True}, size=nearest.size)
        self.gpu.context.enable_only(moderngl.NOTHING)

    def blend(self, equation: int | tuple[int, int]) -> None:
        self.gpu.context.enable_only(moderngl.BLEND)
        self.gpu.context.blend_equation = equation

    def start_pairs(self, first: int, count: int, level: int) -> None:
        """Write the pairs of ``count`` triangles with each node of a level."""
        assert self.cones is not None
        nodes = self.cones.levels[level].size
        pairs = count * nodes[0] * nodes[1]
        stream = self._pairs.get(level)
        if stream is None or stream.length < pairs:
            if stream is not None:
                self.room.drop(stream)
            stream = self._pairs[level] = self.room.stream(PAIR, max(1024, pairs))
        self.room.draw("pair_start", stream, count=pairs, first_triangle=first,
                       nodes=nodes)

    def make_balls(self) -> None:
        """Compute a bounding ball of every triangle at its current position."""
        if self._balls is not None or not self.triangles:
            return
        self._balls = self.room.stream(VALUES, self.triangles).called("ball")
        program = self.compiled("methods/ray_hierarchy/balls", [(self._balls.record, True)])
        program.set(last_element=self.triangles - 1, unit=self.unit)
        self._rectangles.write(span(0, self.triangles))
        program.draw(self._balls, self.samplers, rectangles=self._rectangles)
        self.room.draws += 1

    # Programs and textures ------------------------------------------------------------------

    def compiled(self, name: str, records: list[tuple[Record, bool]],
                 more: Mapping[str, str] | None = None, any_hit: bool = False,
                 **defines: object) -> FullScreenPass:
        """Return the program ``glsl/<name>.frag``. ``records`` holds pairs: a record, and whether
        the program writes (not reads) the record."""
        def make() -> FullScreenPass:
            texts, target = list((more or {}).values()), 0
            for record, writes in records:
                texts.append(record.stream_glsl(writes, target))
                target += record.texels if writes else 0
            text = "\n".join(texts)
            return FullScreenPass(
                self.gpu, f"{name}.frag",
                {**method_defines(self.method, self.accelerator, self.options, any_hit),
                 **kernel_defines(self.method.kernels), **defines},
                {**method_texts(self.method, self.options), "streams": text, "records": text})
        return self.program((name, tuple(records), any_hit, tuple(sorted(defines.items()))), make)

    def rays_pass(self, rays: RayTextures, any_hit: bool, part: str) -> FullScreenPass:
        """Return the pass over all rays for a ``part`` of a call: "start", "nearest" or "finish".
        """
        layout = self.precision.layout
        records = [(rays.record, False), (LEAST, False), (LOWEST, False), (VISITS, False),
                   (layout(self.method.state), True), (layout(HIT), True)]
        records += [(COUNTERS, True)] if self.statistics_on else []
        return self.compiled(f"methods/ray_hierarchy/rays_{part}", records, {}, any_hit)

    def stream(self, record: Record, length: int) -> Stream:
        """Return a reusable stream with at least ``length`` elements."""
        found = self._streams.get(record.name)
        if found is None or found.length < length:
            if found is not None:
                self.room.drop(found)
            length = min(1 << max(10, (length - 1).bit_length()), 4 * self.options["stream_size"])
            found = self._streams[record.name] = self.room.stream(record, length)
        return found

    def _targets_for(self, size: tuple[int, int]) -> None:
        self.make_balls()

        def make() -> tuple[RayCones, list[Target], list[Target]]:
            cones = RayCones(self.gpu, size, self.method.state, self.precision)
            levels = cones.levels[1:] if self.statistics_on else []
            return (cones, [Target(self.gpu, record, size) for record in (LEAST, LOWEST)],
                    [Target(self.gpu, VISITS, level.size) for level in levels])
        self.cones, self._images, self._visits = self.keep(
            "images", make, lambda images: images[0].size == size)
        for visits in self._visits:
            visits.clear()


class _Trace:
    """Tests all batches of triangles. ``now`` is the buffer of the rays' current states."""

    def __init__(self, owner: RayHierarchy, rays: RayTextures, buffers: StateBuffers,
                 statistics: Statistics, any_hit: bool) -> None:
        self.owner, self.rays, self.buffers = owner, rays, buffers
        self.statistics, self.any_hit = statistics, any_hit
        self.now = buffers.side(0)

    def run(self) -> None:
        owner, chunk = self.owner, self.owner.options["stream_size"]
        owner._draw(owner.rays_pass(self.rays, self.any_hit, "start"), self.rays, None, self.now,
                    self.statistics)
        assert owner.cones is not None
        top = owner.cones.top(owner.options["top_nodes"])
        most = max(1, chunk // owner.cones.levels[top].length)
        first, batch = 0, owner.options["first_batch"]
        while first < owner.triangles:
            owner.cones.build(self.rays, self.now, owner.unit)
            self.statistics.draw_calls += len(owner.cones.levels)
            count = min(batch, owner.triangles - first)
            for start in range(first, first + count, most):
                some = min(most, first + count - start)
                owner.start_pairs(start, some, top)
                self._descend(top, some * owner.cones.levels[top].length)
            first, batch = first + count, GROWTH * batch
        owner.hand_down_visits()
        self._update_rays("finish")

    def _descend(self, level: int, pairs: int) -> None:
        """Test the pairs of a level in parts; each part descends to the rays before the next."""
        chunk = self.owner.options["stream_size"] * (1 if level else 4)
        for first in range(0, pairs, chunk):
            count = min(chunk, pairs - first)
            if level:
                kept = self.owner._test(level, first, count)
                self.statistics.passes += 1
                if kept:
                    self._descend(level - 1, kept)
            else:
                self.owner.nearest_of(count, first, self.rays, self.now, self.any_hit)
                self.owner.count_pass(self.statistics)
                self._update_rays("nearest")

    def _update_rays(self, part: str) -> None:
        """Draw a pass over all rays, from the current buffer into the other buffer."""
        other = self.buffers.side(1 if self.now is self.buffers.side(0) else 0)
        self.owner._draw(self.owner.rays_pass(self.rays, self.any_hit, part), self.rays,
                         self.now, other, self.statistics)
        self.now = other
