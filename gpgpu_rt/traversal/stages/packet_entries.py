"""Entry points of packets: a pass at low resolution finds where packets enter the tree.

The method follows Reshetov et al. 2005. A beam bounds all rays of a tile if their bounds are
known, and otherwise a sample of the rays. Packets whose rays lie within the beam begin at the
beam's entry, other packets at the root; see stages/packet_entries.frag.
"""
from __future__ import annotations

import math
import time

import moderngl

from ...gl.full_screen import FullScreenPass
from ...gl.record import Record, streams_glsl
from ...gl.target import Target
from ...rays.textures import RayTextures, StateBuffers
from ...statistics import Statistics
from ..accelerator import Accelerator
from ..driver import Driver, MethodDriver, Samplers, Setup
from ..packet_hits import PacketHits
from ..records import PACKET_ENTRY
from ..schedules import method_defines, method_texts
from .records import TILE_BEAM, TILE_BOUNDS


class PacketEntries(MethodDriver):
    """Runs another driver on packets that begin at the entries of their tiles."""

    def __init__(self, setup: Setup, driver: Driver) -> None:
        super().__init__(setup, driver)
        self.tile: int = setup.options["entry_points"]

    def follow(self, samplers: Samplers, accelerator: Accelerator, step_cap: int) -> None:
        super().follow(samplers, accelerator, step_cap)
        self._hand_on()

    def _hand_on(self) -> None:
        """Give the inner driver the tables and the entries."""
        entries = self.kept.get("entries")
        self.driver.follow({**self.samplers, **(entries.samplers() if entries else {})},
                           self.accelerator, self.step_cap)

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target | PacketHits, int]:
        began = time.perf_counter()
        self.gpu.context.enable_only(moderngl.NOTHING)
        entries = self._entries_for(rays.size)
        program = self._program(rays.record, rays.bounded)
        program.set(ray_texture_size=rays.size, **rays.uniforms())
        samplers = {**self.samplers, **rays.samplers()}
        if rays.bounded:
            samplers |= self._tile_bounds(rays).samplers()
        program.draw(entries, samplers)
        statistics.draw_calls += 1
        if self.statistics_on:
            visited = float(entries.fields()["visited"].sum())
            # Divide by the number of packets: other counters are per packet.
            packet = math.prod(self.options["packet"])
            statistics.add(entry_nodes_visited=visited * packet / math.prod(rays.size),
                           entry_seconds=time.perf_counter() - began)
        return self.driver.run(rays, buffers, statistics, any_hit)

    def _program(self, rays: Record, bounded: bool) -> FullScreenPass:
        def make() -> FullScreenPass:
            setup, streams = self.setup, [rays, TILE_BEAM]
            streams += [TILE_BOUNDS] if bounded else []
            defines = {**method_defines(setup.method, self.accelerator, setup.options, False),
                       "STATISTICS": False, "TILE": self.tile, "BOUNDED": bounded,
                       "OCTANTS": False}     # beams do not depend on the order of nodes
            texts = method_texts(setup.method, {**setup.options, "entry_points": None})
            virtual = {**texts, "streams": streams_glsl(streams, [PACKET_ENTRY]),
                       "walk": f"file:{setup.method.entry_walk}"}
            return FullScreenPass(self.gpu, "stages/packet_entries.frag", defines, virtual)
        return self.program((rays, bounded), make)

    def _entries_for(self, size: tuple[int, int]) -> Target:
        tiles = (-(-size[0] // self.tile), -(-size[1] // self.tile))
        before = self.kept.get("entries")
        entries = self.keep("entries", lambda: Target(self.gpu, PACKET_ENTRY, tiles),
                            lambda entries: entries.size == tiles)
        if entries is not before:
            self._hand_on()
        return entries

    def _tile_bounds(self, rays: RayTextures) -> Target:
        """Return a target to which the bounds of each tile's ray directions are uploaded."""
        assert rays.tiles is not None
        tiles = rays.tiles.of_side(self.tile)
        bounds = self.keep("bounds", lambda: Target(self.gpu, TILE_BOUNDS, tiles.size),
                           lambda bounds: bounds.size == tiles.size)
        bounds.write(TILE_BOUNDS.name, live=tiles.live.reshape(-1),
                     least=tiles.least.reshape(-1, 3), most=tiles.most.reshape(-1, 3))
        return bounds
