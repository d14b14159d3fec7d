"""Entry points of packets: a pass at low resolution finds where the packets of a tile begin.

After Reshetov et al. 2005: a beam around each tile's rays, or some of them where their bounds are
not known, whose entry every packet takes that lies within; see stages/packet_entries.frag.
"""
from __future__ import annotations

import math
import time

import moderngl

from ...gl.context import Gpu
from ...gl.full_screen import FullScreenPass
from ...gl.record import Record, streams_glsl
from ...gl.target import Target
from ...gl.textures import release
from ...rays.textures import RayTextures, StateBuffers
from ...statistics import Statistics
from ..driver import Driver, Samplers, Setup
from ..method import Accelerator
from ..packet_hits import PacketHits
from ..records import PACKET_ENTRY
from ..schedules import method_defines, method_texts
from .records import TILE_BEAM, TILE_BOUNDS


class PacketEntries:
    """Runs another driver on packets that begin where their tiles enter the tree."""

    def __init__(self, setup: Setup, driver: Driver) -> None:
        self.setup, self.gpu, self.driver = setup, setup.gpu, driver
        self.tile: int = setup.options["entry_points"]
        self.samplers, self.accelerator = setup.samplers, setup.accelerator
        self.step_cap = setup.step_cap
        self._programs: dict[tuple[Record, bool], FullScreenPass] = {}
        self._bounds = TileBoundsImage(self.gpu)
        self._entries: Target | None = None
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
            any_hit: bool = False) -> tuple[Target | PacketHits, int]:
        """Trace every ray; where the hits are, and how many rays the step cap stopped."""
        began = time.perf_counter()
        self.gpu.context.enable_only(moderngl.NOTHING)
        entries = self._entries_for(rays.size)
        program = self._program(rays.record, rays.bounded)
        program.set(ray_texture_size=rays.size, **rays.uniforms())
        samplers = {**self.samplers, **rays.samplers()}
        if rays.bounded:
            samplers |= self._bounds.of(rays, self.tile).samplers()
        program.draw(entries, samplers)
        statistics.draw_calls += 1
        if self.setup.options["statistics"]:
            visited = float(entries.fields()["visited"].sum())
            # A packet's share, as counters are a packet's.
            packet = math.prod(self.setup.options["packet"])
            statistics.add(entry_nodes_visited=visited * packet / math.prod(rays.size),
                           entry_seconds=time.perf_counter() - began)
        return self.driver.run(rays, buffers, statistics, any_hit)

    def _program(self, rays: Record, bounded: bool) -> FullScreenPass:
        if (rays, bounded) not in self._programs:
            setup, streams = self.setup, [rays, TILE_BEAM]
            streams += [TILE_BOUNDS] if bounded else []
            defines = {**method_defines(setup.method, self.accelerator, setup.options, False),
                       "STATISTICS": False, "TILE": self.tile, "BOUNDED": bounded,
                       "OCTANTS": False}     # a beam is the same for every order of nodes
            texts = method_texts(setup.method, {**setup.options, "entry_points": None})
            virtual = {**texts, "streams": streams_glsl(streams, [PACKET_ENTRY]),
                       "walk": f"file:{setup.method.entry_walk}"}
            program = FullScreenPass(self.gpu, "stages/packet_entries.frag", defines, virtual)
            program.set(**self.accelerator.uniforms)
            self._programs[rays, bounded] = program
        return self._programs[rays, bounded]

    def _entries_for(self, size: tuple[int, int]) -> Target:
        if self._entries is None or self._size != size:
            release(self._entries)
            self._entries = None
            self._entries = Target(self.gpu, PACKET_ENTRY, (
                -(-size[0] // self.tile), -(-size[1] // self.tile)))
            self._size = size
            self._hand_on()
        return self._entries

    def bytes(self) -> int:
        """Bytes of the entries, and of the driver's own textures."""
        own = self._entries.bytes() if self._entries is not None else 0
        return own + self._bounds.bytes() + self.driver.bytes()

    def release(self) -> None:
        release(self._entries, self._bounds, self._programs, self.driver)
        self._entries = None


class TileBoundsImage:
    """TILE_BOUNDS of the tiles of rays, in textures."""

    def __init__(self, gpu: Gpu) -> None:
        self.gpu = gpu
        self._image: Target | None = None
        self._size = (0, 0)

    def of(self, rays: RayTextures, side: int) -> Target:
        """Those of tiles of so many rays a side."""
        assert rays.tiles is not None
        tiles = rays.tiles.of_side(side)
        if self._image is None or self._size != tiles.size:
            self.release()
            self._image, self._size = Target(self.gpu, TILE_BOUNDS, tiles.size), tiles.size
        self._image.write(TILE_BOUNDS.name, live=tiles.live.reshape(-1),
                          least=tiles.least.reshape(-1, 3), most=tiles.most.reshape(-1, 3))
        return self._image

    def bytes(self) -> int:
        return self._image.bytes() if self._image is not None else 0

    def release(self) -> None:
        release(self._image)
        self._image = None
