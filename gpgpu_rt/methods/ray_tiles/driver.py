"""Tiles of rays: what draws every triangle over the tiles whose cone it meets (Szécsi 2006).

Passes, in this order: the middles of each tile's rays, the cone around them, how far they search;
then for each batch of triangles all pairs with tiles, of which the vertex stage lets through those
that may meet, nearest t by MIN blending, and how far the tiles search from then on; all pairs once
more, for the lowest triangle at each nearest t; and what each ray hit.
"""
from __future__ import annotations

import moderngl
import numpy as np

from ...gl.full_screen import FullScreenPass
from ...gl.precision import Precision
from ...gl.primitive_pass import PrimitivePass
from ...gl.record import TABLE_WIDTH_LOG2, Record, streams_glsl
from ...gl.target import Target
from ...gl.textures import release
from ...rays.records import COUNTERS, HIT
from ...rays.textures import RayTextures, StateBuffers
from ...statistics import Statistics
from ...traversal.driver import Samplers, Setup
from ...traversal.method import Accelerator
from ...traversal.records import FOUND, NEAREST, QUADS
from ...traversal.schedules import UNFINISHED, method_defines, method_texts
from .records import TILE_CONE, TILE_END, TILE_SPAN

PAIRS_AT_ONCE = 1 << 22     # a draw: no longer than a desktop waits for one
NONE = float(1 << 24)       # above every triangle


class RayTiles:
    """Runs `ray-tiles`; a step is a batch of triangles."""

    def __init__(self, setup: Setup) -> None:
        self.gpu, self.method, self.options = setup.gpu, setup.method, setup.options
        self.samplers, self.accelerator = setup.samplers, setup.accelerator
        self.step_cap, self.precision = setup.step_cap, Precision.of(setup.options)
        self.tile: int = setup.options["tile"]
        largest = self.gpu.context.info["GL_POINT_SIZE_RANGE"][1]
        self.points = setup.options["pairs"] == "points" and largest >= self.tile
        self.statistics_on = bool(setup.options["statistics"])
        self._programs: dict[object, FullScreenPass] = {}
        self._pair_programs: dict[object, PrimitivePass] = {}
        self._room: TileTargets | None = None

    def follow(self, samplers: Samplers, accelerator: Accelerator, step_cap: int) -> None:
        """Read these tables from now on: the same records and defines, triangles that moved."""
        self.samplers, self.accelerator, self.step_cap = samplers, accelerator, step_cap

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target, int]:
        """Trace every ray; where the hits are, and how many rays the step cap stopped."""
        context, room = self.gpu.context, self._room_for(buffers.size)
        context.enable_only(moderngl.NOTHING)
        room.targets["nearest"].clear(np.inf)
        room.targets["found"].clear(NONE)
        if self.statistics_on:
            room.targets["quads"].clear()
        for name in ("tile_spans", "tile_cones", "tile_ends"):
            self._pass(name, rays, room.targets[name], statistics, any_hit)
        everything = self.accelerator.structure
        drawn = everything[:self.step_cap]
        try:
            for at, batch in enumerate(drawn):
                if at:
                    self._pass("tile_ends", rays, room.targets["tile_ends"], statistics, any_hit)
                self._pairs(rays, batch, False, statistics, any_hit)
            if not any_hit and drawn:
                self._pairs(rays, (0, sum(drawn[-1])), True, statistics, any_hit)
        finally:
            context.enable_only(moderngl.NOTHING)
            context.blend_equation = moderngl.FUNC_ADD
        final, short = buffers.side(0), len(drawn) < len(everything)
        self._pass("tile_hits", rays, final, statistics, any_hit, steps=len(drawn),
                   cut_short=short)
        return final, self._stopped(final, buffers, statistics) if short else 0

    # Passes ---------------------------------------------------------------------------------

    def _pass(self, name: str, rays: RayTextures, target: Target,
              statistics: Statistics, any_hit: bool, **uniforms: object) -> None:
        """A pass over the tiles, or for hits over the rays."""
        self.gpu.context.enable_only(moderngl.NOTHING)
        program = self._program(name, rays.record, any_hit)
        program.set(ray_texture_size=rays.size, **self.accelerator.uniforms, **rays.uniforms(),
                    **uniforms)
        program.draw(target, self._textures(rays))
        self._count(name, statistics)

    def _pairs(self, rays: RayTextures, batch: tuple[int, int], equal: bool,
               statistics: Statistics, any_hit: bool) -> None:
        """Draw the triangles of a batch over the tiles whose cones they meet."""
        context, room = self.gpu.context, self._room
        assert room is not None
        context.enable_only(moderngl.BLEND | moderngl.PROGRAM_POINT_SIZE)
        context.blend_func = moderngl.ONE, moderngl.ONE
        context.blend_equation = moderngl.MIN
        target = "found" if equal or any_hit else "nearest"
        self._pair_draws(rays, batch, equal, target, False, statistics, any_hit)
        if self.statistics_on:
            context.blend_equation = moderngl.FUNC_ADD
            self._pair_draws(rays, batch, equal, "quads", True, statistics, any_hit)

    def _pair_draws(self, rays: RayTextures, batch: tuple[int, int], equal: bool, target: str,
                    counting: bool, statistics: Statistics, any_hit: bool) -> None:
        room = self._room
        assert room is not None
        textures = self._textures(rays)
        if target == "nearest":     # is not read then, and may not be bound
            textures |= room.targets["found"].samplers(NEAREST.name)
        program = self._pair_program(rays.record, any_hit, counting)
        tiles = room.tiles[0] * room.tiles[1]
        first, count = batch
        at_once = max(1, PAIRS_AT_ONCE // tiles)
        program.set(**self.accelerator.uniforms, **rays.uniforms(), equal=equal,
                    tiles=room.tiles)
        for start in range(first, first + count, at_once):
            pairs = tiles * min(at_once, first + count - start)
            program.set(first_triangle=start)
            if self.points:
                program.draw(room.targets[target], textures, moderngl.POINTS, pairs)
            else:
                program.draw(room.targets[target], textures, moderngl.TRIANGLE_STRIP, 4, pairs)
            self._count("tile_pairs", statistics)

    def _count(self, name: str, statistics: Statistics) -> None:
        statistics.passes += 1
        statistics.draw_calls += 1
        statistics.kernel_passes[name] = statistics.kernel_passes.get(name, 0) + 1

    def _stopped(self, final: Target, buffers: StateBuffers, statistics: Statistics) -> int:
        key = "drivers/classify.frag"
        if key not in self._programs:
            self._programs[key] = FullScreenPass(self.gpu, key, {}, {
                "streams": self._layout(self.method.state).stream_glsl(writes=False)})
        self._programs[key].set(phase=UNFINISHED)
        return self._programs[key].count(buffers.mask, final.samplers(), statistics)

    # Programs and textures ------------------------------------------------------------------

    def _layout(self, record: Record) -> Record:
        return self.precision.layout(record)

    def _textures(self, rays: RayTextures) -> Samplers:
        assert self._room is not None
        return {**self.samplers, **rays.samplers(), **self._room.samplers()}

    def _defines(self, any_hit: bool) -> dict[str, object]:
        return {**method_defines(self.method, self.accelerator, self.options, any_hit),
                "TILE": self.tile}

    def _program(self, name: str, rays: Record, any_hit: bool) -> FullScreenPass:
        key = (name, rays, any_hit)
        if key not in self._programs:
            reads, writes = {
                "tile_spans": ([], [TILE_SPAN]),
                "tile_cones": ([TILE_SPAN], [TILE_CONE]),
                "tile_ends": ([NEAREST, FOUND, HIT], [TILE_END]),
                "tile_hits": ([FOUND, *([QUADS] if self.statistics_on else [])],
                              [self._layout(self.method.state), self._layout(HIT),
                               *([COUNTERS] if self.statistics_on else [])])}[name]
            self._programs[key] = FullScreenPass(
                self.gpu, f"methods/ray_tiles/{name}.frag", self._defines(any_hit),
                {**method_texts(self.method, self.options),
                 "streams": streams_glsl((rays, *reads), writes)})
        return self._programs[key]

    def _pair_program(self, rays: Record, any_hit: bool, counting: bool) -> PrimitivePass:
        """Of pairs, drawn as points or as instances of a quad."""
        key = (rays, any_hit, counting)
        if key not in self._pair_programs:
            texts = [r.stream_glsl(False) for r in (rays, NEAREST, HIT)]
            cones = [r.stream_glsl(False) for r in (TILE_CONE, TILE_END)]
            constants = f"#define TILE {self.tile}\n#define TABLE_WIDTH_LOG2 {TABLE_WIDTH_LOG2}\n"
            constants += "#define POINTS\n" if self.points else ""
            self._pair_programs[key] = PrimitivePass(
                self.gpu, "methods/ray_tiles/tile_pairs.frag", "methods/ray_tiles/tile_pairs.vert",
                {**self._defines(any_hit), "STATISTICS": None, "COUNTING": counting},
                {**method_texts(self.method, self.options), "constants": constants,
                 "streams": "\n".join(texts), "sources": "\n".join(cones)})
        return self._pair_programs[key]

    def _room_for(self, size: tuple[int, int]) -> TileTargets:
        if self._room is None or self._room.size != size:
            release(self._room)
            self._room = TileTargets(self, size)
        return self._room

    def bytes(self) -> int:
        """Bytes of cones, ends, and of what blending keeps of each ray."""
        return self._room.bytes() if self._room is not None else 0

    def release(self) -> None:
        release(self._programs, self._pair_programs, self._room)


class TileTargets:
    """Textures of the tiles, and those that blending draws into."""

    def __init__(self, owner: RayTiles, size: tuple[int, int]) -> None:
        self.size = size
        self.tiles = (-(-size[0] // owner.tile), -(-size[1] // owner.tile))
        records = {"tile_spans": (TILE_SPAN, self.tiles), "tile_cones": (TILE_CONE, self.tiles),
                   "tile_ends": (TILE_END, self.tiles), "nearest": (NEAREST, size),
                   "found": (FOUND, size)}
        if owner.statistics_on:
            records["quads"] = (QUADS, size)
        self.targets = {name: Target(owner.gpu, record, shape)
                        for name, (record, shape) in records.items()}
        for name in records.keys() & {"nearest", "found", "quads"}:
            # Whole tiles, also past the last ray: a point is dropped whose middle is outside.
            self.targets[name].framebuffer.viewport = (0, 0, *(owner.tile * n for n in self.tiles))

    def samplers(self) -> Samplers:
        """Sampler name -> texture of all targets."""
        return {sampler: texture for target in self.targets.values()
                for sampler, texture in target.samplers().items()}

    def bytes(self) -> int:
        """Bytes of all targets."""
        return sum(target.bytes() for target in self.targets.values())

    def release(self) -> None:
        release(self.targets)
