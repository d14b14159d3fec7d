"""First hits: the rasteriser finds the hits of eye rays. With first_hits="rasterised", the hits
equal traced hits to the bit.

Hachisuka's survey (section 5) calls tracing eye rays equivalent to rasterisation. But rasterisers
snap corners to a grid and interpolate depth. So some pixels show a triangle that their ray misses,
or do not show a triangle that their ray hits. The steps:

1. ``first_sieve`` removes triangles that no ray of the image can hit.
2. ``first_drawn`` rasterises the remaining triangles. The depth test keeps one triangle in each
   pixel: the pixel's candidate.
3. In ``first_verified``, each ray tests its candidate by the triangle test that all methods use.
4. ``first_rivals`` looks for rivals: triangles that a ray hits before the pixel's candidate. For
   each triangle T, the program tests the pixels whose rays can hit T. The program skips pixels
   that show T, or a candidate that is certainly in front of T. If T covers many pixels, the host
   splits the search for T into parts of the image. ``first_packed`` and ``first_blocks`` prepare
   the search. ``first_doubt`` marks the pixels with a rival.
5. A ray is in doubt if it misses its candidate, or if its pixel has a rival. The rays in doubt are
   gathered and traced by the tracer's method, and their hits are scattered back.

Every result of the rasteriser is checked before use, so its rounding does not change hits.
``glsl/stages/cover.glsl`` bounds the rays that can hit a triangle. With first_hits="verified",
step 4 is left out, so a hit need not be the nearest.
"""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import moderngl
import numpy as np

from ...errors import OptionError
from ...gl.algorithms.streams import Stream, rows_of, span
from ...gl.context import Gpu
from ...gl.full_screen import FullScreenPass, Rectangles
from ...gl.record import TABLE_WIDTH_LOG2, Record, streams_glsl
from ...gl.row_pass import RowPass
from ...gl.target import Target
from ...gl.textures import TABLE_WIDTH, make_texture, note_moved, table_textures, write_texture
from ...options import word_define
from ...rays.records import COUNTERS, HIT
from ...rays.textures import RayTextures, StateBuffers
from ...scene.camera import Camera
from ...statistics import Statistics
from ..driver import Driver, DriverBase
from ..method import Method
from ..packet_hits import PacketHits
from ..triangle_table import TRIANGLE, triangle_table
from .first_image import BLOCK, PART_SIDE, FirstImage, cut
from .records import PART, SHOWN, SHOWN_BLOCK, SHOWN_FOUR, VERDICT

FIRST_HITS = ("traced", "rasterised", "verified")
# A corner whose depth is below this share of the distance to the scene's farthest corner has no
# position in the image (stages/cover.glsl).
NEAREST = 1e-3
MOST_PIXELS = 24     # split the search into parts if a triangle's extent in pixels is larger
MOST_IN_DOUBT = 0.5  # if a larger share of the rays is in doubt, all rays are traced
TRACED_ROW = 64      # length of a row of rays in doubt; rows keep neighbours together for packets
BEFORE, MANY = 1, 2   # as in stages/verdict.glsl
# Use the rasteriser only if three lengths are in this range: the distance from the eye to the
# scene's farthest corner, and the lengths of the camera's vectors right and up. Outside the range,
# the triangle test or the bounds could overflow or underflow.
SCALES = 1e-6, 1e10


def check_first_hits(first_hits: str, options: Mapping[str, Any]) -> bool:
    """Return whether the rasteriser is needed for a value of the option ``first_hits``.

    With "rasterised", each hit is proved to be the first hit of its ray. With "verified", each hit
    is proved only to be a hit.

    Raises
    ------
    OptionError
        for an unknown ``first_hits``, or for options under which no proof is known
    """
    if first_hits not in FIRST_HITS:
        raise OptionError(f"option first_hits={first_hits!r} is none of {', '.join(FIRST_HITS)}")
    if first_hits != "rasterised":
        return first_hits == "verified"
    for name, needed in (("intersection", "woop-watertight"), ("storage", "fp32"),
                         ("arithmetic", "fp32")):
        if options[name] != needed:
            # The option `era` implies the triangle test and the precision.
            mend = "" if options["era"] else f"{name}={needed} or "
            raise OptionError(f"first_hits=rasterised is proved for {name}={needed} only, not "
                              f"{options[name]}; set {mend}first_hits=traced")
    return True


class FirstHits(DriverBase):
    """A driver that finds the hits of a camera's eye rays by rasterisation.

    A second driver traces all other rays, and the eye rays in doubt.
    """

    def __init__(self, gpu: Gpu, method: Method, options: Mapping[str, Any]) -> None:
        super().__init__(gpu, method, options)
        self._test = {**self.precision.defines(), "TABLE_WIDTH_LOG2": TABLE_WIDTH_LOG2,
                      word_define("INTERSECTION", options["intersection"]): True}
        self._tables: dict[str, moderngl.Texture] = {}
        self._span = self.kept["span"] = Rectangles(gpu, 3)
        self.proved = True     # False: hits are only verified
        self._passes = 0       # passes drawn for the current image, except passes that trace rays

    def take(self, triangles: np.ndarray, driver: Driver) -> None:
        """Use these triangles and this driver from now on.

        Parameters
        ----------
        triangles : (n, 3, 3) float32, rounded as the method's tables store them; a hit on row i
            gets the triangle index i
        """
        self.driver = driver
        corners = triangles.reshape(-1, 3)
        self.count = len(triangles)
        self.bounds = ((corners.min(0), corners.max(0)) if len(corners)
                       else (np.zeros(3), np.zeros(3)))
        self._tables = self.kept["tables"] = table_textures(
            self.gpu, TRIANGLE, triangle_table(triangles)[TRIANGLE.name], into=self._tables)
        self._flags, _ = self.keep("flags", self._make_flags, lambda part: part[0].size == (
            TABLE_WIDTH, rows_of(self.count)))

    def _make_flags(self) -> tuple[moderngl.Framebuffer, moderngl.Texture]:
        texture = self.gpu.context.texture((TABLE_WIDTH, rows_of(self.count)), 1)
        return self.gpu.context.framebuffer([texture]), texture

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target | PacketHits, int]:
        if any_hit or rays.seen_from is None:
            return self.driver.run(rays, buffers, statistics, any_hit)
        view = self._view(rays.seen_from, rays.size)
        if view is None:
            return self._all(rays, buffers, statistics)
        context = self.gpu.context
        final = buffers.side(0)
        image, self._passes = self._image_for(buffers, final), 0
        try:
            drawn = self._sieve(view)
            self._draw(image, drawn, view)
            self._verify(image, rays, view)
            rivals = 0
            if self.proved:
                whole, parts = self._rivals(image, rays, final, drawn, view)
                self._mark(image, rays, final, whole, max(rays.size), view)
                self._mark(image, rays, final, parts, PART_SIDE, view)
                rivals = len(whole) + len(parts)
        finally:
            context.enable_only(moderngl.NOTHING)
        doubt = np.flatnonzero(np.frombuffer(image.doubt.read(alignment=1), np.uint8))
        note_moved(image.doubt, down=rays.size[0] * rays.size[1])
        statistics.passes += self._passes
        statistics.draw_calls += self._passes
        if len(doubt) > MOST_IN_DOUBT * rays.size[0] * rays.size[1]:
            return self._all(rays, buffers, statistics)
        self._count(statistics, rays, len(doubt), len(drawn), rivals)
        return final, self._trace(doubt, rays, final, statistics)

    def _view(self, camera: Camera, size: tuple[int, int]) -> dict[str, object] | None:
        """Return the uniforms of a camera, or None if a scale is outside SCALES."""
        lo, hi = (np.asarray(corner, np.float64) for corner in self.bounds)
        eye = np.asarray(np.float32(camera.eye), np.float64)
        farthest = 1.01 * float(np.linalg.norm(np.maximum(np.abs(lo - eye), np.abs(hi - eye))))
        right, up, forward = camera.basis(size)
        scales = (farthest, float(np.linalg.norm(right)), float(np.linalg.norm(up)))
        if not self.count or not all(
                SCALES[0] < scale < SCALES[1] for scale in scales):
            return None
        return {"eye": camera.eye, "right": tuple(right), "up": tuple(up),
                "forward": tuple(forward), "size": size, "nearest": NEAREST * farthest,
                "farthest": farthest}

    def _all(self, rays: RayTextures, buffers: StateBuffers,
             statistics: Statistics) -> tuple[Target | PacketHits, int]:
        self._count(statistics, rays, rays.size[0] * rays.size[1], 0, 0)
        return self.driver.run(rays, buffers, statistics)

    @staticmethod
    def _count(statistics: Statistics, rays: RayTextures, retraced: int, drawn: int,
               rivals: int) -> None:
        statistics.first_hits = {"drawn": drawn, "rivals": rivals, "retraced": retraced,
                                 "retraced_share": retraced / (rays.size[0] * rays.size[1])}

    # The passes -----------------------------------------------------------------------------

    def _sieve(self, view: dict[str, object]) -> np.ndarray:
        """Return the rows of the triangles that rays of the image may hit."""
        self.gpu.context.enable_only(moderngl.NOTHING)
        program = self._full_screen("first_sieve")
        program.set(**view, last_element=self.count - 1)
        self._span.write(span(0, self.count))
        program.draw(self._flags, self._tables, rectangles=self._span)
        self._passes += 1
        flags = np.frombuffer(self._flags.read(components=1, alignment=1), np.uint8)
        note_moved(self._flags.color_attachments[0], down=flags.nbytes)
        return np.flatnonzero(flags[:self.count])

    def _draw(self, image: FirstImage, drawn: np.ndarray, view: dict[str, object]) -> None:
        context = self.gpu.context
        context.enable_only(moderngl.DEPTH_TEST)
        context.depth_func = "<"
        self.gpu.clear(image.drawn, -1.0, depth=1.0)
        self._row_pass("first_drawn", "row", 3).draw(image.drawn, self._tables, drawn, view)
        self._passes += 1

    def _verify(self, image: FirstImage, rays: RayTextures, view: dict[str, object]) -> None:
        self.gpu.context.enable_only(moderngl.NOTHING)
        writes = (HIT, SHOWN) if self.proved else (HIT,)
        program = self._full_screen("first_verified", (rays.record,), writes, PROVED=self.proved,
                                    IN_DOUBT=len(writes))
        program.set(**view, **rays.uniforms())
        program.draw(image.proved if self.proved else image.verified, {
            **self._tables, **rays.samplers(), "candidates": image.candidates})
        self._passes += 1
        if not self.proved:
            return
        for name, reads, target in (("first_packed", SHOWN, image.fours),
                                    ("first_blocks", SHOWN_FOUR, image.blocks)):
            self._full_screen(name, (reads,), (target.record,)).draw(target, image.samplers())
            self._passes += 1

    def _rivals(self, image: FirstImage, rays: RayTextures, final: Target, drawn: np.ndarray,
                view: dict[str, object]) -> list[np.ndarray]:
        """Return the rivals as two (k, 3) arrays of PART fields: first from a search of the whole
        image, then from searches of parts."""
        side = max(rays.size)
        whole = np.pad(drawn[:, None], ((0, 0), (0, 2)))
        verdict = self._judge(image, rays, final, whole, side, MOST_PIXELS, view)
        found = [whole[verdict["kind"] == BEFORE]]
        many = verdict["kind"] == MANY
        parts = cut(drawn[many], verdict["first"][many], verdict["last"][many])
        verdict = self._judge(image, rays, final, parts, PART_SIDE, side, view)
        found.append(parts[verdict["kind"] == BEFORE])
        return found

    def _judge(self, image: FirstImage, rays: RayTextures, final: Target, parts: np.ndarray,
               side: int, most_pixels: int, view: dict[str, object]) -> dict[str, np.ndarray]:
        """Return the VERDICT fields for ``parts``, (k, 3) PART fields.

        A part has ``side`` x ``side`` pixels. The verdict is MANY for a triangle that covers more
        than ``most_pixels`` pixels along an axis of its part.
        """
        count = len(parts)
        room = self._part_streams(count)
        program = self._full_screen(
            "first_rivals", (PART, SHOWN_FOUR, SHOWN_BLOCK, HIT, rays.record), (VERDICT,))
        rows = rows_of(count)
        if count:
            texels = np.zeros((rows * TABLE_WIDTH, 4), np.float32)
            texels[:count, :3] = parts
            write_texture(room[0].textures[0], texels, (0, 0, TABLE_WIDTH, rows))
            program.set(**view, **rays.uniforms(), last_element=count - 1, part_side=side,
                        most_pixels=most_pixels)
            self._span.write(span(0, count))
            program.draw(room[1], {
                **self._tables, **rays.samplers(), **final.samplers(), **image.samplers(),
                **room[0].samplers()}, rectangles=self._span)
            self._passes += 1
        read = room[1].framebuffer.read((0, 0, TABLE_WIDTH, rows), components=4, dtype="f4")
        note_moved(room[0].textures[0], down=len(read))
        return VERDICT.unpack(np.frombuffer(read, np.float32).reshape(-1, 1, 4)[:count])

    def _mark(self, image: FirstImage, rays: RayTextures, final: Target, rivals: np.ndarray,
              side: int, view: dict[str, object]) -> None:
        """Flag each ray that hits a triangle of ``rivals``, (k, 3) PART fields, before its
        candidate."""
        self._row_pass("first_doubt", "part", 6, (rays.record, HIT)).draw(
            image.doubted, {**self._tables, **rays.samplers(), **final.samplers()}, rivals,
            {**view, **rays.uniforms(), "part_side": side})
        self._passes += len(rivals) > 0

    def _trace(self, doubt: np.ndarray, rays: RayTextures, final: Target,
               statistics: Statistics) -> int:
        """Trace the rays in doubt. Return the number of stopped rays."""
        if self.statistics_on:
            self._clear_counts(final)
        if not len(doubt):
            return 0
        some, buffers, places = self._textures_in_doubt(len(doubt))
        padded = np.full(places.size[0] * places.size[1], -1, np.float32)
        padded[:len(doubt)] = doubt
        write_texture(places, padded)
        some.share_with(rays)
        gather = self._full_screen("first_gather", (), (rays.record,))
        gather.set(image_width=rays.size[0], **rays.uniforms())
        gather.draw(some.target, {**rays.samplers(), "places": places})
        found, stopped = self.driver.run(some, buffers, statistics)
        self.gpu.context.enable_only(moderngl.NOTHING)
        if stopped and not self.statistics_on:
            self._clear_counts(final)
        self._scatter().draw(final, found.samplers(), doubt,
                             {"image": rays.size, "row_length": TRACED_ROW})
        statistics.passes += 2
        statistics.draw_calls += 2
        return stopped

    def _clear_counts(self, final: Target) -> None:
        """Write zeros, which mean no steps and phase DONE, into all records but HIT."""
        for name, record in final.records.items():
            if name != HIT.name:
                nothing = {field.name: np.zeros((final.length, field.width), np.float32)
                           for field in record.fields}
                final.write(name, **nothing)

    # Programs and textures ------------------------------------------------------------------

    def _full_screen(self, name: str, reads: tuple[Record, ...] = (),
                     writes: tuple[Record, ...] = (), **defines: object) -> FullScreenPass:
        return self.program((name, *defines.values()), lambda: FullScreenPass(
            self.gpu, f"stages/{name}.frag",
            {**self._test, "BLOCK": BLOCK, "PART_SIDE": PART_SIDE, **defines},
            {"tables": TRIANGLE.table_glsl(), "streams": streams_glsl(reads, writes)}))

    def _row_pass(self, name: str, attribute: str, vertices: int,
                  reads: tuple[Record, ...] = ()) -> RowPass:
        return self.program(name, lambda: RowPass(
            self.gpu, f"stages/{name}.vert", f"stages/{name}.frag", attribute, vertices,
            self._test, {"tables": TRIANGLE.table_glsl(), "streams": streams_glsl(reads, ()),
                         "constants": f"#define TABLE_WIDTH_LOG2 {TABLE_WIDTH_LOG2}"}))

    def _scatter(self) -> RowPass:
        writes = (self.precision.layout(self.method.state), HIT,
                  *([COUNTERS] if self.statistics_on else []))
        return self.program("first_scatter", lambda: RowPass(
            self.gpu, "stages/first_scatter.vert", "stages/sort_scatter.frag", "place", 1,
            {**self.precision.defines(), "STATISTICS": self.statistics_on},
            {"streams": streams_glsl((), writes)}))

    def _image_for(self, buffers: StateBuffers, final: Target) -> FirstImage:
        return self.keep("image", lambda: FirstImage(self.gpu, buffers, final),
                         lambda image: image.final is final)

    def _part_streams(self, count: int) -> tuple[Stream, Stream]:
        length = max(self.count, 2 * count)
        return self.keep("parts", lambda: (Stream(self.gpu, PART, length),
                                           Stream(self.gpu, VERDICT, length)),
                         lambda part: part[0].length >= count)

    def _textures_in_doubt(self, count: int) -> tuple[RayTextures, StateBuffers, moderngl.Texture]:
        """Return textures for ``count`` rays in doubt, twice as large as needed so that they are
        seldom remade."""
        size = (TRACED_ROW, 2 * -(-count // TRACED_ROW))
        return self.keep("in doubt", lambda: (
            RayTextures(self.gpu, size, self.precision),
            StateBuffers(self.gpu, self.method.state, size, self.statistics_on, self.precision),
            make_texture(self.gpu, size, 1, "rays in doubt")),
            lambda part: part[0].size[1] * TRACED_ROW >= count)

    def release(self) -> None:
        super().release()
        self._tables = {}
