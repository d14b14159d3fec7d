"""Entry points: passes at low resolution find the nodes where each tile's rays enter the tree.

The method follows Reshetov et al. 2005. An entry is a node at which rays begin their walk. A beam
bounds the rays of a tile. The first passes compute the beams of small tiles, and then of larger
tiles. The next passes go from large tiles to small tiles: each tile's beam refines the entry list
of the larger tile around it. Then any driver can trace rays from the entries of their smallest
tiles.
"""
from __future__ import annotations

import math
import time
from dataclasses import replace

import moderngl

from ...gl.full_screen import FullScreenPass
from ...gl.target import Target
from ...gl.textures import release
from ...rays.textures import RayTextures, StateBuffers
from ...statistics import Statistics
from ..accelerator import Accelerator
from ..driver import Driver, MethodDriver, Samplers, Setup
from ..packet_hits import PacketHits
from ..records import ENTRIES, ENTRY_LIST, ENTRY_TILE
from ..schedules import method_defines, method_texts
from .records import ENTRY_POINTS, TILE_BEAM

FAN = 4   # side of a tile, in tiles of the next smaller level


class EntryPoints(MethodDriver):
    """Runs another driver on rays that begin at the entries of their tiles."""

    def __init__(self, setup: Setup, driver: Driver) -> None:
        super().__init__(setup, driver)
        self.tile: int = setup.options["entry_points"]
        self._levels: list[EntryTiles] = []

    def follow(self, samplers: Samplers, accelerator: Accelerator, step_cap: int) -> None:
        super().follow(samplers, accelerator, step_cap)
        self._hand_on()

    def _hand_on(self) -> None:
        """Give the inner driver the tables and the entry lists."""
        if self._levels:
            smallest = self._levels[0]
            self.driver.follow(
                {**self.samplers, **smallest.lists.samplers()},
                replace(self.accelerator, uniforms={**self.accelerator.uniforms,
                                                    "entry_tiles_across": smallest.size[0]}),
                self.step_cap)

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target | PacketHits, int]:
        began = time.perf_counter()
        self.gpu.context.enable_only(moderngl.NOTHING)
        self._levels_for(rays.size)
        self._draw("beam_rays", self._levels[0].beams, rays, rays.samplers(), statistics)
        for below, level in zip(self._levels, self._levels[1:]):
            self._draw("beam_level", level.beams, None, below.beams.samplers(), statistics,
                       below_size=below.size)
        upper: EntryTiles | None = None
        for level in reversed(self._levels):
            self._draw("entry_points", level.entries, upper, level.beams.samplers(), statistics)
            self._draw("entry_columns", level.lists, None, level.entries.samplers(), statistics,
                       entry_tiles_across=level.size[0])
            upper = level
        if self.statistics_on:
            self._count(rays, statistics)
        self.gpu.finish()
        statistics.add(entry_seconds=time.perf_counter() - began)
        return self.driver.run(rays, buffers, statistics, any_hit)

    def _count(self, rays: RayTextures, statistics: Statistics) -> None:
        """Record the number of nodes that beams visited, divided by the number of rays; and the
        mean number of entries of a smallest tile."""
        levels = [level.entries.fields() for level in self._levels]
        visited = sum(float(level["visited"].sum()) for level in levels)
        statistics.add(entry_nodes_visited=visited / math.prod(rays.size))
        statistics.driver["entries"] = float(levels[0]["count"].mean())

    # Passes ---------------------------------------------------------------------------------

    def _draw(self, name: str, target: Target, other: RayTextures | EntryTiles | None,
              samplers: Samplers, statistics: Statistics, **uniforms: object) -> None:
        """Draw a pass into ``target``. ``other`` is a further input: the rays, or the larger tiles
        whose lists the pass refines."""
        program = self._program(name, other)
        if isinstance(other, RayTextures):
            uniforms |= {"ray_texture_size": other.size, **other.uniforms()}
        elif other is not None:
            uniforms["entry_tiles_across"] = other.size[0]
            samplers = {**samplers, **other.lists.samplers()}
        program.set(**uniforms)
        program.draw(target, {**self.samplers, **samplers})
        statistics.draw_calls += 1

    def _program(self, name: str, other: RayTextures | EntryTiles | None) -> FullScreenPass:
        rays = other.record if isinstance(other, RayTextures) else None

        def make() -> FullScreenPass:
            setup = self.setup
            reads, writes = {
                "beam_rays": ([rays], TILE_BEAM), "beam_level": ([TILE_BEAM], TILE_BEAM),
                "entry_points": ([TILE_BEAM], ENTRY_POINTS),
                "entry_columns": ([ENTRY_POINTS], ENTRY_LIST)}[name]
            texts = [record.stream_glsl(False) for record in reads if record not in (None, writes)]
            defines = {**method_defines(setup.method, self.accelerator, setup.options, False),
                       "STATISTICS": False, "TILE": ENTRY_TILE, "FAN": FAN,
                       "UPPER": isinstance(other, EntryTiles),
                       "EACH_LIST(f)": ", ".join(f"f({k})" for k in range(ENTRIES // 4))}
            if name == "beam_rays":   # beams do not depend on the order of nodes
                defines["OCTANTS"] = False
            virtual = {**method_texts(setup.method, setup.options),
                       "streams": "\n".join([*texts, writes.stream_glsl(True)]),
                       "walk": f"file:{setup.method.entry_walk}"}
            return FullScreenPass(self.gpu, f"stages/{name}.frag", defines, virtual)
        return self.program((name, rays, isinstance(other, EntryTiles)), make)

    def _levels_for(self, size: tuple[int, int]) -> None:
        sizes, tile = [], ENTRY_TILE
        while tile <= self.tile:
            sizes.append((-(-size[0] // tile), -(-size[1] // tile)))
            tile *= FAN
        if [level.size for level in self._levels] != sizes:
            self.drop("levels")
            self._levels = self.kept["levels"] = [EntryTiles(self, each) for each in sizes]
            self._hand_on()


class EntryTiles:
    """The tiles of one size: their beams, their entries, and the entries as lists for rays.

    A pass writes entries into several textures. Another pass copies the entries into the single
    texture that rays read.
    """

    def __init__(self, owner: EntryPoints, size: tuple[int, int]) -> None:
        self.size = size
        self.beams = Target(owner.gpu, TILE_BEAM, size)
        self.entries = Target(owner.gpu, ENTRY_POINTS, size)
        self.lists = Target(owner.gpu, ENTRY_LIST, (size[0] * (ENTRIES // 4), size[1]))

    def bytes(self) -> int:
        return sum(image.bytes() for image in (self.beams, self.entries, self.lists))

    def release(self) -> None:
        release(self.beams, self.entries, self.lists)
