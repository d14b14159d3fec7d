"""Entry points of packets: a pass at low resolution finds where the packets of a tile begin.

After Reshetov et al. 2005: a beam around some rays of each tile, whose entry every packet takes
that lies within; see passes/packet_entries.frag.
"""
from __future__ import annotations

import math
import time

import moderngl

from ..methods.row import Accelerator
from ..ray_state import RayTextures, StateBuffer, StateBuffers
from ..record import Record
from ..statistics import Statistics
from ..texel_layout import PACKET_ENTRY, TILE_BEAM
from ..textures import read_texture, release, texture_bytes
from .driver import Driver, Samplers, Setup
from .entry_points import TileImage
from .full_screen import FullScreenPass
from .packet_room import PacketHits
from .traverse import method_defines, method_texts


class PacketEntries:
    """Runs another driver on packets that begin where their tiles enter the tree."""

    def __init__(self, setup: Setup, driver: Driver) -> None:
        self.setup, self.gpu, self.driver = setup, setup.gpu, driver
        self.tile: int = setup.options["entry_points"]
        self.samplers, self.accelerator = setup.samplers, setup.accelerator
        self.step_cap = setup.step_cap
        self._programs: dict[Record, FullScreenPass] = {}
        self._entries: TileImage | None = None
        self._size: tuple[int, int] | None = None

    def follow(self, samplers: Samplers, accelerator: Accelerator, step_cap: int) -> None:
        """Read these tables from now on."""
        self.samplers, self.accelerator, self.step_cap = samplers, accelerator, step_cap
        for program in self._programs.values():
            program.set(**accelerator.uniforms)
        self._hand_on()

    def _hand_on(self) -> None:
        entries = self._entries.samplers() if self._entries is not None else {}
        self.driver.follow({**self.samplers, **entries}, self.accelerator, self.step_cap)

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[StateBuffer | PacketHits, int]:
        """Trace every ray; where the hits are, and how many rays the step cap stopped."""
        began = time.perf_counter()
        self.gpu.context.enable_only(moderngl.NOTHING)
        entries = self._entries_for(rays.size)
        program = self._program(rays.record)
        program.set(ray_texture_size=rays.size, **rays.uniforms())
        program.draw(entries.target, {**self.samplers, **rays.samplers()})
        statistics.draw_calls += 1
        if self.setup.options["statistics"]:
            visited = float(read_texture(entries.textures[3])[..., 3].sum())
            # A packet's share, as counters are a packet's.
            packet = math.prod(self.setup.options["packet"])
            statistics.driver["entry_nodes_visited"] = visited * packet / math.prod(rays.size)
            self.gpu.finish()
            statistics.driver["entry_seconds"] = (
                statistics.driver.get("entry_seconds", 0.0) + time.perf_counter() - began)
        return self.driver.run(rays, buffers, statistics, any_hit)

    def _program(self, rays: Record) -> FullScreenPass:
        if rays not in self._programs:
            setup = self.setup
            defines = {**method_defines(setup.method, self.accelerator, setup.options, False),
                       "STATISTICS": False, "TILE": self.tile,
                       "OCTANTS": False}     # a beam is the same for every order of nodes
            virtual = {"streams": "\n".join([rays.stream_glsl(False), TILE_BEAM.stream_glsl(False),
                                             PACKET_ENTRY.stream_glsl(True)]),
                       "walk": f"file:{setup.method.entry_walk}",
                       "tables": method_texts(setup.method, {**setup.options,
                                                             "entry_points": None})["tables"]}
            program = FullScreenPass(self.gpu, "passes/packet_entries.frag", defines, virtual)
            program.set(**self.accelerator.uniforms)
            self._programs[rays] = program
        return self._programs[rays]

    def _entries_for(self, size: tuple[int, int]) -> TileImage:
        if self._entries is None or self._size != size:
            release(self._entries)
            self._size = size
            self._entries = TileImage(self.gpu, PACKET_ENTRY, (
                -(-size[0] // self.tile), -(-size[1] // self.tile)))
            self._hand_on()
        return self._entries

    def bytes(self) -> int:
        """Bytes of the entries, and of the driver's own textures."""
        own = texture_bytes(self._entries.textures) if self._entries is not None else 0
        return own + self.driver.bytes()

    def release(self) -> None:
        release(self._entries, self._programs, self.driver)
        self._entries = None
