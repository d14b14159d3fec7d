"""Path tracing: global illumination by waves of paths that advance one vertex at a time.

The algorithm is that of Kajiya, "The Rendering Equation", SIGGRAPH 1986, with next-event
estimation and Russian roulette; ``reference/path.py`` explains the weights. A wave contains a
block of texels for each pixel, one path per texel. The ray of an ended path has an empty interval,
so every method skips the ray. Passes skip the path's texel by the depth test.

Random numbers depend only on seed, pixel, sample and vertex, and samples are added in a fixed
order. So pictures are bit-identical for all methods and sizes of a wave, with or without packing
of live paths.
"""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import moderngl
import numpy as np

from ..gl.precision import Precision
from ..gl.record import EXACT_INTEGER
from ..gl.textures import read_texture, release
from ..methods.choices import INCOHERENT
from ..options import OFF, Option, resolve_options
from ..rays.eye_rays import eye_uniforms, share_eye
from ..rays.records import HIT, RAY_TEXELS
from ..rays.textures import RayTextures
from ..reference.path_settings import MOST_SURVIVE, SAMPLERS, PathSettings
from ..scene.camera import Camera
from ..scene.light_choice import LightChoice
from ..scene.luminance import LUMINANCE
from ..scene.region import Region
from ..scene.scene import Scene
from .integrator import ALL_FEATURES, Integrator, PicturePass, Samplers, Trace
from .needs import Asked, SceneNeeds
from .packed_paths import COMPACT, PACKED, PACKING, PackedPaths, PathTextures, share_of
from .picture_streams import PictureStreams, PixelStream
from .records import CAME_FROM, DIRECT, LIT, RADIANCE, SUMS, WALK
from .tone_map import EXPOSURE, TONE_MAP

WAVE = 1 << 19      # largest number of paths in a wave, unless the picture has more pixels
FEWEST = 16         # estimate the noise from the variance of at least this many samples

_DEFAULTS = PathSettings()
_VERTEX_WRITES = (("next_rays", RAY_TEXELS), ("next_walk", WALK), ("lit", LIT),
                  ("shadow_rays", RAY_TEXELS, "SHADOWS"), ("direct", DIRECT, "SHADOWS"))


class Path(Integrator):
    """Path tracing: all light, with noise that decreases with the number of samples."""

    name = "path"
    rays = INCOHERENT      # diffuse surfaces scatter rays, so only eye rays are coherent
    centred = False
    _sums: PictureStreams | None = None
    _level: PathTextures | None = None
    _packed: PackedPaths | None = None
    options = (
        ALL_FEATURES,
        Option("bounces", _DEFAULTS.bounces, "largest number of bounces of a path", int,
               minimum=0, label="most bounces"),
        Option("samples", 64, "largest number of paths per pixel", int, minimum=1,
               maximum=EXACT_INTEGER, common=True, label="samples per pixel"),
        Option("noise", None, "stop when the standard error of the pixels is at most this share "
               "of their luminance, both averaged over the picture", float, minimum=0,
               label="stop at noise", unset=OFF),
        Option("roulette", _DEFAULTS.roulette, "first path vertex at which Russian roulette may "
               "end a path", int, minimum=1, label="roulette from bounce"),
        Option("seed", _DEFAULTS.seed, "seed of the random numbers", int, minimum=0,
               label="random seed"),
        Option("sampler", _DEFAULTS.sampler, "how random numbers are chosen: sobol spreads them "
               "evenly over a pixel's samples, with less noise; random draws them independently",
               choices=SAMPLERS, label="sample numbers"),
        COMPACT, EXPOSURE, TONE_MAP)
    passes = (
        PicturePass("path start", "render/path_start.frag", (), (),
                    (("rays", RAY_TEXELS), ("walk", WALK))),
        PicturePass("path vertex", "render/path_vertex.frag", (),
                    (("rays", RAY_TEXELS), ("hit", HIT), ("walk", WALK)), _VERTEX_WRITES),
        PicturePass("packed path vertex", "render/path_vertex.frag", PACKED,
                    (("rays", RAY_TEXELS), ("hit", HIT), ("walk", WALK), ("came_from", CAME_FROM)),
                    _VERTEX_WRITES, ("PACKED",)),
        PicturePass("path gather", "render/path_gather.frag", (),
                    (("lit", LIT), ("direct", DIRECT), ("hit", HIT), ("walk", WALK)),
                    (("radiance", RADIANCE),)),
        PicturePass("path mask", "render/path_mask.frag", (), (("walk", WALK),)),
        PicturePass("path sums", "render/path_sums.frag", (),
                    (("radiance", RADIANCE), ("sums", SUMS)), (("next_sums", SUMS),)),
        *PACKING,
    )

    @classmethod
    def asked(cls, options: Mapping[str, Any], precision: Precision) -> Asked:
        given = resolve_options(options, cls.options, f"integrator {cls.name}")
        return Asked(given["bounces"], 1, precision, given["all_features"], paths=True,
                     sampler=_settings(given).sampler, packs=share_of(given) > 0)

    @property
    def planned(self) -> SceneNeeds:
        return self.needs if self.packed_sizes else self.needs.without("packed paths")

    @property
    def defines(self) -> dict[str, object]:
        return {**super().defines, "SOBOL": self.needs.asked.sampler == "sobol"}

    def streams(self) -> tuple[PixelStream, ...]:
        return (PixelStream("next rays", RAY_TEXELS),
                PixelStream("walk 0", WALK), PixelStream("walk 1", WALK),
                PixelStream("lit", LIT), PixelStream("shadow rays", RAY_TEXELS, ("SHADOWS",)),
                PixelStream("direct", DIRECT, ("SHADOWS",)), PixelStream("radiance", RADIANCE))

    def take(self, scene: Scene) -> None:
        super().take(scene)
        lights = LightChoice.of(scene)
        self._uniforms.update(light_count=len(lights), light_density=lights.density,
                              **lights.far_uniforms(scene))
        for program in self._programs.values():
            program.set(**self._uniforms)

    def start(self, region: Region, options: Mapping[str, Any] = {}) -> None:
        given = resolve_options(options, self.options, f"integrator {self.name}")
        self.samples, self.noise_target = given["samples"], given["noise"]
        self.settings = _settings(given)
        super().start(region, options)

    def _make_room(self, size: tuple[int, int]) -> None:
        """Allocate streams with a block of texels per pixel, and sums with one texel per pixel."""
        self.block = _block(min(self.samples, WAVE // (size[0] * size[1])), size,
                            self.gpu.max_texture_size)
        super()._make_room((size[0] * self.block[0], size[1] * self.block[1]))
        assert self.room is not None
        if self._sums is None or self._sums.size != size:
            release(self._sums)
            self._sums = PictureStreams(self.gpu, size, self.precision,
                                        [PixelStream("sums 0", SUMS), PixelStream("sums 1", SUMS)])
        self._level = self._level or PathTextures(self.gpu, self.room)
        share = share_of(self.given, self.size[0] * self.size[1])
        if self._packed is None or self._packed.share != share:
            release(self._packed)
            self._packed = PackedPaths(self, self.size, self.precision, share)

    @property
    def packed_sizes(self) -> list[tuple[int, int]]:
        return self._packed.sizes if self._packed is not None else []

    def draw(self, trace: Trace, rays: RayTextures, camera: Camera) -> np.ndarray:
        assert self.room is not None and self._sums is not None
        self._sums.target("sums 0").clear()
        self.samples_done, self.noise, self.radiance = 0, None, None
        side = 0
        try:
            while self.samples_done < self.samples:
                self._take_samples(trace, rays, camera, side)
                side = 1 - side
                if self._finished(f"sums {side}"):
                    break
        except KeyboardInterrupt:    # ``radiance`` keeps the picture of the samples so far
            if self.samples_done:
                self.gpu.context.enable_only(moderngl.NOTHING)
                self.progress, self.samples = None, self.samples_done
                self._finished(f"sums {side}")
            raise
        return self.show(self.mean)

    def _take_samples(self, trace: Trace, rays: RayTextures, camera: Camera, side: int) -> None:
        """Trace a wave and add its samples to the sums. Read the stream "sums {side}" and write
        the other stream of sums."""
        assert self.room is not None and self._sums is not None
        shared = {"block": self.block, "corner": self.region.corner,
                  "first_sample": self.samples_done,
                  "samples": self.samples, "seed": self.settings.seed}
        self._wave(trace, rays, camera, shared)
        self.run("path sums", self._sums.target(f"sums {1 - side}"),
                 {**self.room.samplers("radiance", "radiance"),
                  **self._sums.samplers(f"sums {side}", "sums")}, **shared)
        self.samples_done = min(self.samples_done + self.block[0] * self.block[1],
                                self.samples)

    def _wave(self, trace: Trace, rays: RayTextures, camera: Camera,
              shared: Mapping[str, Any]) -> None:
        """Trace the next samples of all pixels until all paths have ended."""
        assert self.room is not None and self._level is not None and self._packed is not None
        context, level = self.gpu.context, self._level
        self.room.target("radiance").clear()
        level.start(rays)
        eye = eye_uniforms(camera, self.region.whole, self.scene.bounds)
        with level.target(rays, "walk 0") as start:
            self.run("path start", start, {}, **eye, **shared)
        share_eye(rays, eye)
        width, height = self.region.size
        live = width * height * min(self.block[0] * self.block[1],
                                    self.samples - self.samples_done)
        for vertex in range(1, self.settings.bounces + 2):
            if self.packed_sizes:
                self._count_vertex(vertex, live, level)
            source = {**level.now.samplers(), **trace(level.now).samplers(), **level.samplers()}
            with level.target(level.then, level.walk[1], "lit", "shadow rays",
                              "direct") as target:
                context.enable_only(moderngl.DEPTH_TEST)
                self.run("packed path vertex" if level.packed else "path vertex", target, source,
                         **shared, vertex=vertex, last=vertex > self.settings.bounces,
                         roulette=self.settings.roulette, most_survive=MOST_SURVIVE)
                context.enable_only(moderngl.NOTHING)
            level.then.share_start(None)
            if not self._gather(trace, level, source):
                break
            context.enable_only(moderngl.DEPTH_TEST)
            self.run("path mask", level.mask, source)
            level.turn()
            if self.packed_sizes:
                live = self._live(level)
                if not live:
                    break
                level = self._packed.pack(level, live)
            context.enable_only(moderngl.NOTHING)
        self._packed.bring_back(level)

    def _gather(self, trace: Trace, level: PathTextures, source: Samplers) -> bool:
        """Add the light that paths find at a vertex. Return whether paths may go on."""
        room, context = level.room, self.gpu.context
        found = {**source, **room.samplers(level.walk[1], "walk"), **room.samplers("lit", "lit")}
        if "shadow rays" in room:
            # Get the hits before blending is on: for packets, `samplers` of the hits runs a pass,
            # which must not blend.
            found.update(trace(room.rays["shadow rays"], any_hit=True).samplers())
            found.update(room.samplers("direct", "direct"))
        with level.target(None, "radiance") as target:
            context.enable_only(moderngl.BLEND | moderngl.DEPTH_TEST)
            context.blend_func = moderngl.ONE, moderngl.ONE
            query = self.gpu.query()
            with query:
                self.run("path gather", target, found)
            context.enable_only(moderngl.NOTHING)
        return query.samples > 0

    def _live(self, level: PathTextures) -> int:
        query = self.gpu.query()
        with level.target(None) as target, query:
            self.run("path live", target, level.samplers())
        self.gpu.context.enable_only(moderngl.NOTHING)
        return query.samples

    def _count_vertex(self, vertex: int, live: int, level: PathTextures) -> None:
        if len(self.vertices) < vertex:
            self.vertices.append({"live": 0, "texels": 0})
        self.vertices[vertex - 1]["live"] += live
        self.vertices[vertex - 1]["texels"] += level.texels

    def _finished(self, sums: str) -> bool:
        """Compute the mean radiance so far and its noise. Return whether the noise is at most the
        target."""
        done = self.samples_done
        asked = self.noise_target is not None or self.progress is not None
        if not (asked or done == self.samples):
            return False
        assert self._sums is not None
        total = read_texture(self._sums.textures(sums)[0]).astype(np.float64) / done
        self.mean = total[:, :, :3]
        self.radiance = self.mean.astype(np.float32)
        bright = self.mean @ LUMINANCE
        spread = np.maximum(total[:, :, 3] - bright ** 2, 0) / max(done - 1, 1)
        if done >= min(FEWEST, self.samples) and bright.any():
            self.noise = float(np.sqrt(spread).mean() / bright.mean())
        if self.progress is not None:
            self.progress(done, self.samples, np.inf if self.noise is None else self.noise)
        return (self.noise is not None and self.noise_target is not None
                and self.noise <= self.noise_target)

    def bytes(self) -> dict[str, int]:
        return {**super().bytes(), **(self._sums.bytes() if self._sums else {}),
                **(self._packed.bytes() if self._packed else {})}

    def _release_room(self) -> None:
        super()._release_room()
        release(self._sums, self._level, self._packed)
        self._sums = self._level = self._packed = None


def _settings(given: Mapping[str, Any]) -> PathSettings:
    return PathSettings(given["bounces"], given["roulette"], given["seed"], given["sampler"])


def _block(most: int, size: tuple[int, int], largest: int) -> tuple[int, int]:
    """Return the columns and rows of a pixel's block of texels in a wave. Their product is 1, or a
    power of two up to ``most``. No side of the wave's textures exceeds ``largest``."""
    columns = rows = 1
    while 2 * columns * rows <= most:
        wider = 2 * columns * size[0] <= largest and columns <= rows
        if not wider and 2 * rows * size[1] > largest:
            break
        columns, rows = (2 * columns, rows) if wider else (columns, 2 * rows)
    return columns, rows
