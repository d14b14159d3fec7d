"""Packets step by step: one texel a packet holds its state, and its stack lies in an atlas."""
from __future__ import annotations

from dataclasses import replace

import moderngl

from ..gl.full_screen import FullScreenPass
from ..gl.precision import Precision
from ..gl.record import Record, streams_glsl
from ..gl.target import Target
from ..gl.textures import release
from ..rays.records import COUNTERS, HIT
from ..rays.textures import PingPong, RayTextures, StateBuffers
from ..statistics import Statistics
from .driver import Samplers, Setup, Watch
from .method import Accelerator
from .packets import packet_defines, packet_of
from .schedules import UNFINISHED, kernel_defines, method_texts
from .stack_atlas import StackAtlas

QUERY_INTERVAL = 16   # steps between two counts of the packets that are over


class PacketSteps:
    """A packet method under the schedule ``step``; see ``Traversal``.

    A step is a pass over the rays, in which those whose packet stands at a triangle test it, and a
    pass over the packets, each of which then visits a node or moves on to another triangle. What
    it has for its stack is drawn into the atlas between steps.
    """

    watch: Watch | None = None

    def __init__(self, setup: Setup) -> None:
        self.gpu, self.method, options = setup.gpu, setup.method, setup.options
        self.options, self.samplers = options, setup.samplers
        self.accelerator, self.step_cap = setup.accelerator, setup.step_cap
        self.precision = Precision.of(options)
        assert self.method.packet_state is not None
        stepwise = self.method.packet_state(options)
        self.state, self.entry, self.glsl = stepwise.state, stepwise.stack_entry, stepwise.glsl
        self.phases = kernel_defines(stepwise.kernels)
        self.counted = [COUNTERS] if options["statistics"] else []
        self._programs: dict[object, FullScreenPass] = {}
        self._room: PacketStates | None = None

    def follow(self, samplers: Samplers, accelerator: Accelerator, step_cap: int) -> None:
        """Read these tables from now on: the same records and defines, triangles that moved."""
        self.samplers, self.accelerator, self.step_cap = samplers, accelerator, step_cap
        for program in self._programs.values():
            program.set(**accelerator.uniforms)

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target, int]:
        """Trace every ray; where the hits are, and how many rays the step cap stopped."""
        self.gpu.context.enable_only(moderngl.NOTHING)
        room = self._room_for(buffers.size)
        now, then = 0, 1
        self._visit(rays, room, None, None, room.side(now), any_hit, statistics)
        self._intersect(rays, room.side(now), None, buffers.side(now), any_hit, statistics)
        while self._live(room, room.side(now), statistics):
            for _ in range(self.options["mask_interval"] or QUERY_INTERVAL):
                hits = buffers.side(then)
                self._intersect(rays, room.side(now), buffers.side(now), hits, any_hit,
                                statistics)
                self._visit(rays, room, room.side(now), hits, room.side(then), any_hit,
                            statistics)
                now, then = then, now
        final = buffers.side(then)
        self._intersect(rays, room.side(now), buffers.side(now), final, any_hit, statistics)
        return final, self._stopped(final, buffers, statistics)

    # Passes ---------------------------------------------------------------------------------

    def _visit(self, rays: RayTextures, room: PacketStates, source: Target | None,
               hits: Target | None, target: Target, any_hit: bool,
               statistics: Statistics) -> None:
        """A step of every packet."""
        program = self._program("packet_visit", rays.record, any_hit, source is None)
        textures = {**self.samplers, **rays.samplers(), **(hits.samplers() if hits else {}),
                    **(source.samplers() if source else {})}
        if room.atlas is not None:
            textures |= room.atlas.samplers()
            program.set(**room.atlas.uniforms)
        program.set(ray_texture_size=rays.size, step_cap=self.step_cap, **rays.uniforms())
        program.draw(target, textures)
        statistics.passes += 1
        statistics.draw_calls += 1
        if room.atlas is not None and source is not None:
            room.atlas.push(target.samplers())
            self.gpu.context.enable_only(moderngl.NOTHING)
            statistics.draw_calls += 1
        if self.watch is not None:
            self.watch("visit", source, target)

    def _intersect(self, rays: RayTextures, packets: Target, source: Target | None,
                   target: Target, any_hit: bool, statistics: Statistics) -> None:
        """What every ray does in a step."""
        program = self._program("packet_intersect", rays.record, any_hit, source is None)
        program.set(**rays.uniforms())
        program.draw(target, {
            **self.samplers, **rays.samplers(), **(source.samplers() if source else {}),
            **{f"packet_{name}": texture for name, texture in packets.samplers().items()}})
        statistics.passes += 1
        statistics.draw_calls += 1
        if self.watch is not None:
            self.watch("intersect", source, target)

    def _live(self, room: PacketStates, packets: Target, statistics: Statistics) -> int:
        program = self._counting("drivers/mask.frag", self.state)
        done = program.count(room.mask, packets.samplers(), statistics)
        return room.size[0] * room.size[1] - done

    def _stopped(self, final: Target, buffers: StateBuffers, statistics: Statistics) -> int:
        program = self._counting("drivers/classify.frag", self.method.state)
        program.set(phase=UNFINISHED)
        return program.count(buffers.mask, final.samplers(), statistics)

    # Programs and textures ------------------------------------------------------------------

    def _program(self, name: str, rays: Record, any_hit: bool, start: bool) -> FullScreenPass:
        key = (name, rays, any_hit, start)
        if key not in self._programs:
            layout = self.precision.layout
            state, hit = layout(self.state), layout(HIT)
            reads: list[Record] = [rays]
            if name == "packet_visit":
                reads += [hit] + ([layout(self.entry)] if self.entry is not None else [])
                writes = [state, *self.counted]
            else:
                reads += [replace(record, name="packet_" + record.name)
                          for record in (state, *self.counted)]
                writes = [layout(self.method.state), hit, *self.counted]
            self._programs[key] = FullScreenPass(
                self.gpu, f"drivers/{name}.frag",
                {**packet_defines(self.method, self.accelerator, self.options, any_hit),
                 **self.phases, "START": start},
                {**method_texts(self.method, self.options), "stepwise": f"file:{self.glsl}",
                 "streams": streams_glsl(reads, writes)})
            self._programs[key].set(**self.accelerator.uniforms)
        return self._programs[key]

    def _counting(self, entry: str, state: Record) -> FullScreenPass:
        if entry not in self._programs:
            self._programs[entry] = FullScreenPass(self.gpu, entry, {}, {
                "streams": self.precision.layout(state).stream_glsl(writes=False)})
        return self._programs[entry]

    def _room_for(self, rays: tuple[int, int]) -> PacketStates:
        width, height = packet_of(self.options)
        size = (-(-rays[0] // width), -(-rays[1] // height))
        if self._room is None or self._room.size != size:
            release(self._room)
            self._room = PacketStates(self, size)
        return self._room

    def bytes(self) -> int:
        """Bytes of the packets' states and of their stacks."""
        return self._room.bytes() if self._room is not None else 0

    def release(self) -> None:
        release(self._programs, self._room)


class PacketStates(PingPong):
    """The ping-pong pair of packets' states, and the atlas of their stacks."""

    def __init__(self, owner: PacketSteps, size: tuple[int, int]) -> None:
        state = owner.precision.layout(owner.state)
        super().__init__(owner.gpu, [state, *owner.counted], size)
        self.atlas: StackAtlas | None = None
        if owner.entry is not None:
            self.atlas = StackAtlas(owner.gpu, owner.entry, state,
                                    owner.accelerator.stack_levels, size,
                                    owner.precision, owner.phases)

    def bytes(self) -> int:
        """Bytes of states and stacks."""
        return super().bytes() + (self.atlas.bytes() if self.atlas is not None else 0)

    def release(self) -> None:
        release(self.atlas)
        super().release()
