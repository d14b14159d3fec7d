"""Packets: a fragment traces several rays, in a single pass (Horn et al. 2007)."""
from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import replace
from typing import Any

import moderngl

from ..gl.full_screen import FullScreenPass
from ..gl.record import Record, streams_glsl
from ..gl.target import Target
from ..options import TRACER_OPTIONS, resolve_options
from ..rays.records import COUNTERS, HIT
from ..rays.textures import RayTextures, StateBuffers
from ..statistics import Statistics
from .accelerator import Accelerator
from .driver import UNFINISHED, MethodDriver, Samplers, Setup
from .method import Method
from .packet_hits import PacketHits, PacketTargets
from .packet_tiles import PacketTiles, TilePass
from .schedules import Traversal, method_defines, method_texts

# Largest number of steps of a packet in its pass. A step costs at most three loop iterations, and
# llvmpipe ends every loop after 65,535 iterations.
PACKET_STEPS = 20_000
# Phase of an unsettled ray: the limit PACKET_STEPS stopped its packet before the ray's search was
# over.
LIVE = 1


class PacketTraversal(MethodDriver):
    """A packet method's programs for one set of tables and options; see ``Traversal``."""

    def __init__(self, setup: Setup) -> None:
        super().__init__(setup)
        self.packet = packet_of(self.options)
        self.rays = self.packet[0] * self.packet[1]
        # A render target has one of three layouts. With ``rows_alone`` (fewer targets than rays),
        # a texel holds the triangle-table rows of four hits. With ``fours``, a texel holds one
        # field, such as t, of four hits. Otherwise, a texel holds all fields of one hit.
        self.rows_alone = self.rays > self.gpu.max_draw_buffers
        self.targets = self.rays // 4 if self.rows_alone else self.rays
        self.fours = self.rays % 4 == 0 and not self.rows_alone
        self._tiles = PacketTiles(self.gpu, self.packet, self.options.get("entry_points"))

    def follow(self, samplers: Samplers, accelerator: Accelerator, step_cap: int) -> None:
        super().follow(samplers, accelerator, step_cap)
        self.drop("single")     # the single-ray driver has the old triangles

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target | PacketHits, int]:
        room = self._targets_for(buffers.size)
        self.gpu.context.enable_only(moderngl.NOTHING)

        def hand_back() -> Target:
            return self._hand_back(rays, buffers, room, statistics, any_hit)

        query = self.gpu.query()
        drawn = self._draw_packets("packet", rays, room, statistics, any_hit, query)
        statistics.queries += 1
        # The program discards unfinished packets. Draw all packets again if any was discarded.
        left_behind = query.samples < drawn
        if left_behind:
            self._draw_packets("packet_unsettled", rays, room, statistics, any_hit)
        if self.statistics_on:
            self._draw_packets("packet_counters", rays, room, statistics, any_hit)
        statistics.passes += 1 + left_behind
        if not (left_behind or self.rows_alone or self.statistics_on):
            return PacketHits(room, any_hit, hand_back), 0
        now = hand_back()
        if not left_behind:
            return now, 0
        if self.step_cap > PACKET_STEPS:
            self._trace_singly(rays, now, statistics, any_hit)
        return now, self.count_stopped(now, buffers, statistics)

    def _draw_packets(self, name: str, rays: RayTextures, room: PacketTargets,
                      statistics: Statistics, any_hit: bool, query: Any = nullcontext()) -> int:
        """Trace packets within ``query``, an occlusion query, and return their number. Packets in
        squares without a ray to trace are not counted, and get misses."""
        # With ``rows_alone``, draw all packets: packet_none.frag writes floats into skipped
        # squares, but the targets hold integers.
        samplers = {**self.samplers, **rays.samplers()}
        squares = None if self.rows_alone else self._tiles.squares(rays, samplers)
        counted = name == "packet_counters"
        target = room.target(counted, any_hit)
        uniforms = {"ray_texture_size": room.rays, **rays.uniforms(),
                    "most_steps": min(PACKET_STEPS, self.step_cap)}
        if squares is None:
            program = self._program(name, any_hit, rays.record)
            program.set(**uniforms)
            with query:
                program.draw(target, samplers)
            statistics.draw_calls += 1
            return math.prod(room.size)
        some, none = (self._tile_pass(one, any_hit, rays.record)
                      for one in (name, "packet_counters_none" if counted else "packet_none"))
        some.set(**uniforms)
        with query:
            some.draw_on(squares, target, samplers)
        none.draw_on(squares._replace(some=~squares.some), room.target(counted, True), samplers)
        statistics.draw_calls += 2
        return squares.packets(room.size)

    def _hand_back(self, rays: RayTextures, buffers: StateBuffers, room: PacketTargets,
                   statistics: Statistics, any_hit: bool) -> Target:
        now, program = buffers.side(0), self._program("packet_hits", any_hit, rays.in_textures)
        capped = self.step_cap <= PACKET_STEPS
        program.set(unsettled_phase=UNFINISHED if capped else LIVE)
        rays.complete()
        self.draw(program, now, {**self.samplers, **rays.samplers(), **room.samplers(any_hit)},
                  statistics)
        return now

    def _trace_singly(self, rays: RayTextures, now: Target, statistics: Statistics,
                      any_hit: bool) -> None:
        """Trace the unsettled rays (phase LIVE) as single rays, and write their hits to ``now``.
        """
        single = self._single_traversal()
        single_rays, single_buffers = self.keep("single rays", lambda: (
            rays.like(rays.size),
            StateBuffers(self.gpu, single.method.state, rays.size, False, self.precision)),
            lambda part: part[0].fits(rays))
        rays.complete()
        self._program("left_behind", any_hit, rays.in_textures).draw(
            single_rays.target, {**rays.samplers(), **now.samplers()})
        found, _ = single.run(single_rays, single_buffers, statistics, any_hit)
        single_samplers = {**single_rays.samplers(), **found.samplers()}
        counted = len(now.streams.get(COUNTERS.name, ()))
        channels = [(True,) * 4] * (len(now.textures) - counted)
        # Keep the packets' counters.
        now.framebuffer.color_mask = (*channels, *[(False,) * 4] * counted)
        self._program("brought_back", any_hit, rays.in_textures).draw(
            now, {f"single_{name}": texture for name, texture in single_samplers.items()})
        now.framebuffer.color_mask = ((True,) * 4,) * len(now.textures)
        statistics.draw_calls += 2

    def _single_traversal(self) -> Traversal:
        def make() -> Traversal:
            row = self.setup.find_method(str(self.method.single))
            known = (*TRACER_OPTIONS, *row.options)
            shared = {option.name: self.options[option.name] for option in known
                      if option.name in self.options and option.accepts(self.options[option.name])}
            # Single rays begin at the root: only packets have entry points here.
            shared.pop("entry_points", None)
            options = resolve_options({**shared, "schedule": "loop", "statistics": False}, known,
                                      f"method {row.name}")
            samplers, accelerator = self.setup.prepare_other(row, options)
            return Traversal(replace(
                self.setup, method=row, samplers=samplers, accelerator=accelerator,
                options=options, step_cap=self.step_cap))
        return self.keep("single", make)

    # Programs and textures ------------------------------------------------------------------

    def _program(self, name: str, any_hit: bool, rays: Record) -> FullScreenPass:
        return self.program((name, any_hit, rays), lambda: FullScreenPass(
            self.gpu, *self._texts(name, any_hit, rays)))

    def _tile_pass(self, name: str, any_hit: bool, rays: Record) -> TilePass:
        return self.program(("tiles", name, any_hit, rays), lambda: TilePass(
            self.gpu, *self._texts(name, any_hit, rays)))

    def _texts(self, name: str, any_hit: bool,
               rays: Record) -> tuple[str, dict[str, object], dict[str, str]]:
        """Return a fragment program's file, defines and included texts."""
        file = name.replace("_counters", "").replace("_unsettled", "")
        alone = any_hit or name == "packet_none"
        defines = {**self._defines(any_hit, alone), "SETTLED_ALONE": name == "packet"}
        if name in ("packet", "packet_unsettled", "packet_none"):   # only "packet_counters" counts
            defines["STATISTICS"] = False
        return f"drivers/{file}.frag", defines, {**self._virtual(name, rays),
                                                 "targets": self._targets_text(alone)}

    def _defines(self, any_hit: bool, alone: bool) -> dict[str, object]:
        """Return the defines of a program that writes hits, or only triangles (``alone``)."""
        targets = self.targets // 4 if alone and self.fours else self.targets
        return {**packet_defines(self.method, self.accelerator, self.options, any_hit),
                "PACKET_TARGETS": targets,
                "EACH_TARGET(f)": " ".join(f"f({k})" for k in range(targets))}

    def _targets_text(self, alone: bool) -> str:
        layout = ("rows" if self.rows_alone else "hits" if not self.fours else
                  "triangles" if alone else "numbers")
        return f"file:drivers/targets_{layout}.glsl"

    def _virtual(self, name: str, rays: Record) -> dict[str, str]:
        layout = self.precision.layout
        written = [layout(self.method.state), layout(HIT)]
        written += [COUNTERS] if self.statistics_on else []
        reads: list[Record] = [rays]
        writes: list[Record] = []
        if name in ("packet", "packet_unsettled", "packet_counters"):
            # The program only needs the declarations of these streams' structs.
            reads += [r for r in written if r.name != "state"]
        elif name == "packet_hits":
            writes = written
        elif name == "left_behind":
            reads += written[:1]
            writes = [replace(rays, name="single_rays")]
        elif name in ("packet_none", "packet_counters_none"):
            reads += [layout(HIT)]      # the program needs only the struct of HIT
        else:
            single = layout(self._single_traversal().method.state)
            reads = [replace(rays, name="single_rays"),
                     replace(single, name="single_state"),
                     replace(layout(HIT), name="single_hit")]
            writes = written[:2]
        return {**method_texts(self.method, self.options), "streams": streams_glsl(reads, writes)}

    def _targets_for(self, size: tuple[int, int]) -> PacketTargets:
        return self.keep("targets", lambda: PacketTargets(
            self.gpu, size, self.packet, self.targets, self.rows_alone, self.fours,
            self.statistics_on), lambda targets: targets.rays == size)


def packet_of(options: Mapping[str, Any]) -> tuple[int, int]:
    """Return a packet's width and height in rays; (1, 1) without the option ``packet``."""
    return options.get("packet", (1, 1))


def packet_defines(method: Method, accelerator: Accelerator, options: Mapping[str, Any],
                   any_hit: bool) -> dict[str, object]:
    width, height = packet_of(options)
    return {**method_defines(method, accelerator, options, any_hit),
            "PACKET_WIDTH": width, "PACKET_HEIGHT": height,
            "EACH(f)": " ".join(f"f({r});" for r in range(width * height))}
