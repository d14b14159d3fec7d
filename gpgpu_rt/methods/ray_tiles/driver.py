"""Driver of `ray-tiles`: draws triangles over the tiles whose cones they may hit (Szécsi 2006).

The passes, in this order:

1. ``tile_spans`` computes, for each tile, the centre of the box around the rays' origins, and the
   mean of their directions.
2. ``tile_cones`` computes the cone around each tile's rays.
3. ``tile_ends`` computes the distance to which each tile's rays search.
4. For each batch of triangles, ``tile_pairs`` draws all pairs of a triangle and a tile. The vertex
   stage drops a pair if the tile's cone cannot meet the triangle. MIN blending keeps each ray's
   nearest t. Before the next batch, step 3 is repeated.
5. ``tile_pairs`` draws all pairs once more, and keeps the lowest index of the triangles at each
   ray's nearest t. With ``any_hit``, step 4 keeps an index instead of t, and step 5 is omitted.
6. ``tile_hits`` writes the hit of each ray.
"""
from __future__ import annotations

import moderngl
import numpy as np

from ...gl.full_screen import FullScreenPass
from ...gl.primitive_pass import PrimitivePass
from ...gl.record import TABLE_WIDTH_LOG2, Record, streams_glsl
from ...gl.target import Target
from ...gl.textures import release
from ...rays.records import COUNTERS, HIT
from ...rays.textures import RayTextures, StateBuffers
from ...statistics import Statistics
from ...traversal.driver import MethodDriver, Samplers, Setup
from ...traversal.records import FOUND, NEAREST, QUADS
from ...traversal.schedules import method_defines, method_texts
from .records import TILE_CONE, TILE_END, TILE_SPAN

PAIRS_AT_ONCE = 1 << 22     # limit on pairs in a draw call; a longer call would block the desktop
NONE = float(1 << 24)       # larger than the index of every triangle


class RayTiles(MethodDriver):
    """The driver of `ray-tiles`. A step is a batch of triangles."""

    def __init__(self, setup: Setup) -> None:
        super().__init__(setup)
        self.tile: int = setup.options["tile"]
        largest = self.gpu.context.info["GL_POINT_SIZE_RANGE"][1]
        self.points = setup.options["pairs"] == "points" and largest >= self.tile

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target, int]:
        context, room = self.gpu.context, self._targets_for(buffers.size)
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
        return final, self.count_stopped(final, buffers, statistics) if short else 0

    # Passes ---------------------------------------------------------------------------------

    def _pass(self, name: str, rays: RayTextures, target: Target,
              statistics: Statistics, any_hit: bool, **uniforms: object) -> None:
        """Draw a pass with a fragment per tile; ``tile_hits`` has a fragment per ray."""
        self.gpu.context.enable_only(moderngl.NOTHING)
        program = self._program(name, rays.record, any_hit)
        program.set(ray_texture_size=rays.size, **rays.uniforms(), **uniforms)
        self.draw(program, target, self._textures(rays), statistics, name)

    def _pairs(self, rays: RayTextures, batch: tuple[int, int], equal: bool,
               statistics: Statistics, any_hit: bool) -> None:
        context = self.gpu.context
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
        room = self._targets
        textures = self._textures(rays)
        # A pass must not sample its own target. This pass does not read NEAREST, so bind another
        # texture in its place.
        if target == "nearest":
            textures |= room.targets["found"].samplers(NEAREST.name)
        program = self._pair_program(rays.record, any_hit, counting)
        tiles = room.tiles[0] * room.tiles[1]
        first, count = batch
        at_once = max(1, PAIRS_AT_ONCE // tiles)
        program.set(**rays.uniforms(), equal=equal, tiles=room.tiles)
        for start in range(first, first + count, at_once):
            pairs = tiles * min(at_once, first + count - start)
            program.set(first_triangle=start)
            if self.points:
                program.draw(room.targets[target], textures, moderngl.POINTS, pairs)
            else:
                program.draw(room.targets[target], textures, moderngl.TRIANGLE_STRIP, 4, pairs)
            self.count_pass(statistics, "tile_pairs")

    # Programs and textures ------------------------------------------------------------------

    def _textures(self, rays: RayTextures) -> Samplers:
        return {**self.samplers, **rays.samplers(), **self._targets.samplers()}

    def _defines(self, any_hit: bool) -> dict[str, object]:
        return {**method_defines(self.method, self.accelerator, self.options, any_hit),
                "TILE": self.tile}

    def _program(self, name: str, rays: Record, any_hit: bool) -> FullScreenPass:
        def make() -> FullScreenPass:
            layout, counted = self.precision.layout, self.statistics_on
            reads, writes = {
                "tile_spans": ([], [TILE_SPAN]),
                "tile_cones": ([TILE_SPAN], [TILE_CONE]),
                "tile_ends": ([NEAREST, FOUND, HIT], [TILE_END]),
                "tile_hits": ([FOUND, *([QUADS] if counted else [])],
                              [layout(self.method.state), layout(HIT),
                               *([COUNTERS] if counted else [])])}[name]
            return FullScreenPass(
                self.gpu, f"methods/ray_tiles/{name}.frag", self._defines(any_hit),
                {**method_texts(self.method, self.options),
                 "streams": streams_glsl((rays, *reads), writes)})
        return self.program((name, rays, any_hit), make)

    def _pair_program(self, rays: Record, any_hit: bool, counting: bool) -> PrimitivePass:
        def make() -> PrimitivePass:
            texts = [r.stream_glsl(False) for r in (rays, NEAREST, HIT)]
            cones = [r.stream_glsl(False) for r in (TILE_CONE, TILE_END)]
            constants = f"#define TILE {self.tile}\n#define TABLE_WIDTH_LOG2 {TABLE_WIDTH_LOG2}\n"
            constants += "#define POINTS\n" if self.points else ""
            return PrimitivePass(
                self.gpu, "methods/ray_tiles/tile_pairs.frag", "methods/ray_tiles/tile_pairs.vert",
                {**self._defines(any_hit), "STATISTICS": None, "COUNTING": counting},
                {**method_texts(self.method, self.options), "constants": constants,
                 "streams": "\n".join(texts), "sources": "\n".join(cones)})
        return self.program(("tile_pairs", rays, any_hit, counting), make)

    def _targets_for(self, size: tuple[int, int]) -> TileTargets:
        self._targets = self.keep("targets", lambda: TileTargets(self, size),
                                  lambda targets: targets.size == size)
        return self._targets


class TileTargets:
    """The targets with a texel per tile, and the blended targets with a texel per ray."""

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
            # The renderer drops a point whose centre is outside the viewport, so the viewport
            # covers whole tiles.
            self.targets[name].framebuffer.viewport = (0, 0, *(owner.tile * n for n in self.tiles))

    def samplers(self) -> Samplers:
        """Return sampler name -> texture for all targets."""
        return {sampler: texture for target in self.targets.values()
                for sampler, texture in target.samplers().items()}

    def bytes(self) -> int:
        return sum(target.bytes() for target in self.targets.values())

    def release(self) -> None:
        release(self.targets)
