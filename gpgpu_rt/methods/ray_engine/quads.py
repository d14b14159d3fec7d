"""Quads: draws triangles as quads over the texels of a batch's rays; a pass writes the hits."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import moderngl
import numpy as np

from ...gl.full_screen import FullScreenPass, Rectangles
from ...gl.precision import Precision
from ...gl.primitive_pass import PrimitivePass
from ...gl.record import TABLE_WIDTH_LOG2, Record
from ...gl.target import Target
from ...gl.textures import note_moved, release, write_texture
from ...rays.records import HIT, NO_RAY, NO_TRIANGLE
from ...traversal.accelerator import Accelerator
from ...traversal.driver import Samplers, Setup
from ...traversal.records import FOUND, NEAREST
from ...traversal.schedules import method_defines, method_texts
from ...traversal.triangle_table import TRIANGLE

WIDTH = 256        # rays in a texture row of a batch
NO_T = 3.4e38      # larger than every t


@dataclass(frozen=True)
class Runs:
    """Runs of consecutive rays of a batch that wait for the triangles of the same cell.

    Attributes
    ----------
    first, count : (k,) int64, the first ray and the number of rays of each of k runs
    cell : (k,) int64, the cell of each run
    """

    first: np.ndarray
    count: np.ndarray
    cell: np.ndarray

    @classmethod
    def of(cls, keys: np.ndarray) -> Runs:
        """Return the runs of equal cells in (n,) sorted keys."""
        first = np.flatnonzero(np.diff(keys, prepend=-1))
        return cls(first, np.diff(first, append=len(keys)), keys[first])

    def rectangles(self) -> tuple[np.ndarray, np.ndarray]:
        """Cover each run by at most three rectangles, in a texture with rows of WIDTH texels.

        Returns
        -------
        (m, 4) float32, left, top, right and bottom of each rectangle; (m,), each rectangle's run
        """
        top, left = np.divmod(self.first, WIDTH)
        bottom, right = np.divmod(self.first + self.count - 1, WIDTH)
        one = top == bottom
        zero, full = np.zeros_like(left), np.full_like(left, WIDTH)
        corners = np.stack([
            np.stack([left, top, np.where(one, right + 1, full), top + 1], 1),
            np.stack([zero, top + 1, full, bottom], 1),
            np.stack([zero, bottom, right + 1, bottom + 1], 1)], 1)
        kept = np.stack([np.ones_like(one), bottom > top + 1, ~one], 1)
        return corners[kept].astype(np.float32), np.nonzero(kept)[0]


class BatchTargets:
    """The textures of a batch, and the passes over the batch.

    Parameters
    ----------
    rays : largest number of rays in a batch
    by_depth : whether the depth test, rather than MIN blending, keeps the nearest hit
    record : the record of a ray
    """

    def __init__(self, setup: Setup, rays: int, by_depth: bool, record: Record) -> None:
        self.gpu, self.by_depth, self.record = setup.gpu, by_depth, record
        self.precision = Precision.of(setup.options)
        gpu = setup.gpu
        self.size = (WIDTH, max(1, -(-rays // WIDTH)))
        gpu.check_size(*self.size, f"a batch of {rays:,} rays")
        # The rays' fields already have the tracer's precision; a float32 texture keeps them exact.
        self.rays = Target(gpu, record, self.size)
        self.hit_record = replace(HIT, storage=self.precision.storage)
        self.depth = gpu.context.depth_renderbuffer(self.size)
        self.hits = Target(gpu, self.hit_record, self.size, self.depth)
        self.nearest, self.first = (Target(gpu, kept, self.size) for kept in (NEAREST, FOUND))
        self.by_depth_test = Target(gpu, FOUND, self.size, self.depth, self.first.streams)
        self.targets = {"KEEP_NEAREST": self.nearest, "KEEP_FIRST": self.first,
                        "KEEP_DEPTH": self.by_depth_test}
        self._quads: dict[tuple[str, bool], PrimitivePass] = {}
        self._left: FullScreenPass | None = None
        self._rows = Rectangles(gpu, 1)
        self._setup = setup
        self.hits.clear()

    @property
    def passes(self) -> tuple[str, ...]:
        """The passes that draw quads, in order; quads.frag says which data each pass keeps."""
        return ("KEEP_DEPTH",) if self.by_depth else ("KEEP_NEAREST", "KEEP_FIRST")

    def upload(self, rays: Mapping[str, np.ndarray]) -> int:
        """Upload the fields of a batch's rays. Return the number of bytes."""
        packed = self.record.pack(**rays)
        rows = -(-len(packed) // WIDTH)
        texels = np.repeat(NO_RAY[:self.record.texels, None], rows * WIDTH, axis=1)
        texels[:, :len(packed)] = packed.transpose(1, 0, 2)
        for texture, values in zip(self.rays.textures, texels):
            write_texture(texture, values, (0, 0, WIDTH, rows))
        self._rows.write(np.array([[0, 0, WIDTH, rows]]))
        self.rows = rows
        return int(texels.nbytes)

    def samplers(self) -> Samplers:
        """Return sampler name -> texture of the batch's rays and intermediate results."""
        return {**self.rays.samplers(), **self.nearest.samplers(), **self.first.samplers()}

    def draw_quads(self, keep: str, any_hit: bool, samplers: Samplers, accelerator: Accelerator,
                   quads: moderngl.Buffer, count: int, depth_end: float) -> None:
        """Draw ``count`` quads. A quad is a rectangle (4 floats) and a triangle's row (int)."""
        context = self.gpu.context
        target = self.targets[keep]
        target.framebuffer.depth_mask = True     # clearing and drawing write depth
        target.clear(red=NO_T if keep == "KEEP_NEAREST" else NO_TRIANGLE, depth=1.0)
        if keep == "KEEP_DEPTH":
            context.enable_only(moderngl.DEPTH_TEST)
            context.depth_func = "<"
        else:
            context.enable_only(moderngl.BLEND)
            context.blend_func = moderngl.ONE, moderngl.ONE
            context.blend_equation = moderngl.MIN
        program = self._keeping(keep, any_hit)
        program.take(quads, "4f 1i/i", "rectangle", "row")
        program.set(**accelerator.uniforms, depth_end=depth_end,
                    scale=(2.0 / target.size[0], 2.0 / target.size[1]))
        try:
            program.draw(target, {**samplers, **self.samplers()}, moderngl.TRIANGLE_STRIP, 4,
                         count)
        finally:
            context.enable_only(moderngl.NOTHING)
            context.blend_equation = moderngl.FUNC_ADD

    def _keeping(self, keep: str, any_hit: bool) -> PrimitivePass:
        key, setup = (keep, any_hit), self._setup
        if key not in self._quads:
            streams = [self.record.stream_glsl(False), HIT.stream_glsl(False)]
            if keep == "KEEP_FIRST":
                streams.append(NEAREST.stream_glsl(False))
            streams.append((NEAREST if keep == "KEEP_NEAREST" else FOUND).stream_glsl(True))
            self._quads[key] = PrimitivePass(
                self.gpu, "methods/ray_engine/quads.frag", "methods/ray_engine/quads.vert",
                {**method_defines(setup.method, setup.accelerator, setup.options, any_hit),
                 "STATISTICS": False, keep: True},
                {**method_texts(setup.method, setup.options), "streams": "\n".join(streams),
                 "tables": self.precision.layout(TRIANGLE).table_glsl(),
                 "table_width": f"#define TABLE_WIDTH_LOG2 {TABLE_WIDTH_LOG2}"})
        return self._quads[key]

    def left(self) -> FullScreenPass:
        """Return the program that writes the hits of the batch's rays."""
        if self._left is None:
            setup = self._setup
            streams = (self.record.stream_glsl(False), FOUND.stream_glsl(False),
                       self.hit_record.stream_glsl(True))
            self._left = FullScreenPass(
                self.gpu, "methods/ray_engine/quad_hits.frag",
                {**method_defines(setup.method, setup.accelerator, setup.options, False),
                 "STATISTICS": False},
                {**method_texts(setup.method, setup.options), "streams": "\n".join(streams)})
        return self._left

    def draw_left(self, samplers: Samplers, accelerator: Accelerator) -> None:
        """Draw the hits of the batch's rays into ``hits``."""
        program = self.left()
        program.set(**accelerator.uniforms)
        program.draw(self.hits, {**samplers, **self.samplers()}, rectangles=self._rows)

    def read(self, count: int) -> tuple[dict[str, np.ndarray], int]:
        """Read back the hits of the batch's rays. Return the hits' fields, and the bytes read."""
        data = self.hits.framebuffer.read((0, 0, WIDTH, self.rows), 4, dtype="f4")
        note_moved(self.hits.textures[0], down=len(data))
        texels = np.frombuffer(data, np.float32).reshape(-1, 1, 4)
        return self.hit_record.unpack(texels[:count]), len(data)

    def bytes(self) -> int:
        return sum(target.bytes() for target in (self.rays, self.hits, self.nearest, self.first))

    def release(self) -> None:
        release(self.hits, self.targets, self.rays, self.depth, self._quads, self._left,
                self._rows)
