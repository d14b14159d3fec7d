"""Packets under the schedule ``step``: textures hold the packets' states between passes.

If packets have stacks, an atlas texture (stack_atlas.py) holds the stacks.
"""
from __future__ import annotations

from dataclasses import replace

import moderngl

from ..gl.full_screen import FullScreenPass
from ..gl.record import Record, streams_glsl
from ..gl.target import Target
from ..gl.textures import release, stream_samplers
from ..rays.records import COUNTERS, HIT
from ..rays.textures import PingPong, RayTextures, StateBuffers
from ..statistics import Statistics
from .driver import MethodDriver, Samplers, Setup
from .packets import packet_defines, packet_of
from .schedules import kernel_defines, method_texts
from .stack_atlas import StackAtlas


class PacketSteps(MethodDriver):
    """A packet method under the schedule ``step``; see ``Traversal``.

    A step is two passes. In the pass over the rays, each ray tests its packet's current triangle,
    if there is one. In the pass over the packets, each packet visits a node or advances to the
    next triangle. A draw then pushes the packets' stack entries into the atlas, if there is an
    atlas.
    """

    keeps_states = True

    def __init__(self, setup: Setup) -> None:
        super().__init__(setup)
        assert self.method.packet_state is not None
        stepwise = self.method.packet_state(self.options)
        self.state, self.entry = stepwise.state, stepwise.stack_entry
        self.texts = {"stepwise": f"file:{stepwise.glsl}", "ray_step": f"file:{stepwise.ray}"}
        self.phases = kernel_defines(stepwise.kernels)
        self.counted = [COUNTERS] if self.statistics_on else []

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target, int]:
        self.gpu.context.enable_only(moderngl.NOTHING)
        room = self._states_for(buffers.size)
        now, then = 0, 1
        self._visit(rays, room, None, None, room.side(now), any_hit, statistics)
        self._intersect(rays, room.side(now), None, buffers.side(now), any_hit, statistics)
        while self._live(room, room.side(now), statistics):
            for _ in range(self.mask_interval):
                hits = buffers.side(then)
                self._intersect(rays, room.side(now), buffers.side(now), hits, any_hit,
                                statistics)
                self._visit(rays, room, room.side(now), hits, room.side(then), any_hit,
                            statistics)
                now, then = then, now
        final = buffers.side(then)
        self._intersect(rays, room.side(now), buffers.side(now), final, any_hit, statistics)
        return final, self.count_stopped(final, buffers, statistics)

    # Passes ---------------------------------------------------------------------------------

    def _visit(self, rays: RayTextures, room: PacketStates, source: Target | None,
               hits: Target | None, target: Target, any_hit: bool,
               statistics: Statistics) -> None:
        program = self._program("packet_visit", rays.record, any_hit, source is None)
        textures = {**self.samplers, **rays.samplers(), **(hits.samplers() if hits else {}),
                    **(_of_packets(source) if source else {})}
        for record in self.counted if source else ():   # the packets' own counters
            textures |= stream_samplers(record.name, source.streams[record.name])
        if room.atlas is not None:
            textures |= room.atlas.samplers()
            program.set(**room.atlas.uniforms)
        program.set(ray_texture_size=rays.size, step_cap=self.step_cap, **rays.uniforms())
        self.draw(program, target, textures, statistics)
        if room.atlas is not None and source is not None:
            room.atlas.push(target.samplers())
            self.gpu.context.enable_only(moderngl.NOTHING)
            statistics.draw_calls += 1

    def _intersect(self, rays: RayTextures, packets: Target, source: Target | None,
                   target: Target, any_hit: bool, statistics: Statistics) -> None:
        program = self._program("packet_intersect", rays.record, any_hit, source is None)
        program.set(ray_texture_size=rays.size, **rays.uniforms())
        self.draw(program, target, {
            **self.samplers, **rays.samplers(), **(source.samplers() if source else {}),
            **_of_packets(packets)}, statistics)

    def _live(self, room: PacketStates, packets: Target, statistics: Statistics) -> int:
        program = self.state_program("mask", self.state)
        done = program.count(room.mask, packets.samplers(), statistics)
        return room.size[0] * room.size[1] - done

    # Programs and textures ------------------------------------------------------------------

    def _program(self, name: str, rays: Record, any_hit: bool, start: bool) -> FullScreenPass:
        def make() -> FullScreenPass:
            layout = self.precision.layout
            of_ray = [layout(self.method.state), layout(HIT)]
            of_packet, *counters = [replace(record, name="packet_" + record.name)
                                    for record in (layout(self.state), *self.counted)]
            options = self.options
            defines = {**self.phases, "START": start}
            if name == "packet_visit":
                reads = [rays, *of_ray, *([layout(self.entry)] if self.entry is not None else [])]
                writes = [of_packet, *self.counted]
            else:
                reads, writes = [rays, of_packet, *counters], [*of_ray, *self.counted]
                options = {**options, "packet": (1, 1)}     # a packet with a single ray
                width, height = packet_of(self.options)
                defines["PACKET_OF_RAY"] = f"ivec2({width}, {height})"
            program = FullScreenPass(
                self.gpu, f"drivers/{name}.frag",
                {**packet_defines(self.method, self.accelerator, options, any_hit), **defines},
                {**method_texts(self.method, self.options), **self.texts,
                 "streams": streams_glsl(reads, writes)})
            program.kernel = "init" if start else name.removeprefix("packet_")
            return program
        return self.program((name, rays, any_hit, start), make)

    def _states_for(self, rays: tuple[int, int]) -> PacketStates:
        width, height = packet_of(self.options)
        size = (-(-rays[0] // width), -(-rays[1] // height))
        return self.keep("states", lambda: PacketStates(self, size),
                         lambda states: states.size == size)


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
        return super().bytes() + (self.atlas.bytes() if self.atlas is not None else 0)

    def release(self) -> None:
        release(self.atlas)
        super().release()


def _of_packets(packets: Target) -> Samplers:
    """Return the samplers of packets' records, under names that rays' samplers do not have."""
    return {f"packet_{name}": texture for name, texture in packets.samplers().items()}
