"""Whitted's ray tracing: direct light with shadows at every hit, reflection and refraction.

The algorithm is that of Whitted, "An Improved Illumination Model for Shaded Display", CACM 1980.
The recursion runs on the host, over whole images instead of single rays. A branch is a sequence of
reflections and refractions. A wave contains the rays of one branch, with a texel for each pixel.
An occlusion query counts the rays of a branch in the pass that makes these rays. A branch without
rays ends. After the eye rays, passes draw only the tiles in which a branch has rays, because most
texels are empty after several bounces.

Reflected rays are traced in the next wave, so two sets of textures, used alternately, suffice.
Refracted rays wait until their branch is traced, so each depth needs its own textures for them.
"""
from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass

import moderngl
import numpy as np

from ..gl.full_screen import Rectangles
from ..gl.textures import read_texture, stream_samplers
from ..rays.records import HIT, RAY_TEXELS
from ..rays.textures import RayTextures
from ..reference.sobol import reversed_bits, sobol_first_two
from ..scene.camera import Camera
from ..traversal.live_tiles import TILE, rectangles_of
from .integrator import Hits, Integrator, PicturePass, Samplers, Trace
from .lights import light_uniforms
from .picture_streams import PixelStream
from .records import DIRECT, LIT, LIVE, PATH, RADIANCE, SCREEN

_AT_ONCE = 1 << 12     # number of sample positions that are computed together
_RAYS, _HIT, _PATH = ("rays", RAY_TEXELS), ("hit", HIT), ("path", PATH)
_LIT, _DIRECT, _RADIANCE = ("lit", LIT), ("direct", DIRECT), ("radiance", RADIANCE)
_BRANCH = {"reads": (_RAYS, _HIT, _PATH), "writes": (("bounce", RAY_TEXELS), ("next_path", PATH))}


@dataclass(frozen=True)
class Wave:
    """The rays of one branch.

    Attributes
    ----------
    rays : the textures of the rays
    path : the texture of the rays' weights; an arbitrary, unread texture for eye rays
    depth : the number of bounces so far
    corners : (n, 4), the rectangles of the image that contain rays, in texels; None for the whole
        image
    """

    rays: RayTextures
    path: Samplers
    depth: int = 0
    corners: np.ndarray | None = None


class Whitted(Integrator):
    """Mirrors, dielectrics, hard shadows from point lights and soft shadows from emitting
    triangles."""

    name = "whitted"
    _ended = False      # whether rays ended because of the option ``bounces``
    passes = (
        PicturePass("surfaces", "render/surfaces.frag", (), (_RAYS, _HIT, _PATH),
                    (("shadow_rays", RAY_TEXELS, "SHADOWS"), _LIT, ("direct", DIRECT, "SHADOWS"))),
        PicturePass("keep hits", "render/keep_hits.frag", ("MANY_LIGHTS",), (_HIT,),
                    (("kept", HIT),)),
        PicturePass("reflect", "render/branch.frag", ("BOUNCES",), **_BRANCH),
        PicturePass("refract", "render/branch.frag", ("DIELECTRICS",), **_BRANCH,
                    defines=("REFRACTED",)),
        PicturePass("live tiles", "render/path_tiles.frag", ("BOUNCES",), (_PATH,),
                    (("live", LIVE),)),
        PicturePass("gather", "render/gather.frag", ("GATHERED",), (_LIT, _DIRECT, _HIT, _PATH),
                    (_RADIANCE,)),
        PicturePass("picture", "render/picture.frag", (), (_LIT, _DIRECT, _HIT, _RADIANCE)),
    )

    def streams(self) -> tuple[PixelStream, ...]:
        depths = range(1, max(self.needs.bounces, 1) + 1)
        return (PixelStream("lit", LIT), PixelStream("direct", DIRECT, ("SHADOWS",)),
                PixelStream("shadow rays", RAY_TEXELS, ("SHADOWS",)),
                PixelStream("kept hits", HIT, ("MANY_LIGHTS",)),
                PixelStream("radiance", RADIANCE, ("GATHERED",)),
                *(s for k in depths[:2] for s in _branch(f"reflected {k % 2}", "BOUNCES")),
                *(s for k in depths for s in _branch(f"refracted {k}", "DIELECTRICS")),
                PixelStream("live tiles", LIVE, ("BOUNCES",), TILE), PixelStream("screen", SCREEN))

    @property
    def centred(self) -> bool:      # type: ignore[override]
        return self.needs.asked.samples == 1

    def draw(self, trace: Trace, rays: RayTextures, camera: Camera) -> np.ndarray:
        assert self.room is not None
        samples = self.needs.asked.samples
        self._ended = False
        if "radiance" in self.room:
            self.room.target("radiance").clear()
        for sample, aside in enumerate(places_in_pixel(samples)):
            self.eye_rays(rays, camera, aside)
            self._lights = {depth: light_uniforms(self.scene, self.needs, depth, sample)
                            for depth in range(self.needs.bounces + 1)}
            # Programs that follow bounces need a bound texture of weights, even for eye rays.
            unread = (stream_samplers("path", rays.textures[:1])
                      if self.needs.want(("BOUNCES",)) else {})
            shadows = self._wave(trace, Wave(rays, unread))
            if samples > 1:
                self.samples_done = sample + 1
                if self.progress is not None:
                    self.progress(sample + 1, samples, np.inf)
        if self._ended:
            warnings.warn(f"rays end after {self.needs.bounces} bounces; mirrors and glass that "
                          "they meet then show the surroundings of the scene; --bounces "
                          "(Python: bounces) sets a higher limit", stacklevel=6)
        source, shared = {**self._lit(), **shadows.samplers()}, {}
        if "radiance" in self.room:
            source.update(self.room.samplers("radiance", "radiance"))
            shared["sample_share"] = 1 / samples
        self.run("picture", self.room.target("screen"), source, linear=not self.is_plain, **shared)
        found = read_texture(self.room.textures("screen")[0])[:, :, :3]
        return ((found * 255 + 0.5).astype(np.uint8) if self.is_plain
                else self.show(found.astype(np.float64)))

    def _wave(self, trace: Trace, wave: Wave) -> Hits:
        """Trace the rays of a branch, add the light that they find, and trace the child branches.
        Return the hits of the branch's last shadow rays; without shadow rays, return the branch's
        own hits."""
        assert self.room is not None
        hits = trace(wave.rays)
        source = {**wave.rays.samplers(), **hits.samplers(), **wave.path}
        tiles = self._tiles(wave)
        branches: list[Wave] = []
        self._ended |= 0 < wave.depth == self.needs.asked.bounces
        if wave.depth < self.needs.bounces:
            for word, name, define in (
                    ("reflect", f"reflected {(wave.depth + 1) % 2}", "BOUNCES"),
                    ("refract", f"refracted {wave.depth + 1}", "DIELECTRICS")):
                if self.needs.want((define,)):
                    branches += self._branch(word, name, source, wave, tiles)
        hits = self._light(trace, source, wave, tiles, hits)
        for branch in branches:
            self._wave(trace, branch)
        return hits

    def _branch(self, word: str, name: str, source: Samplers, wave: Wave,
                tiles: Rectangles | None) -> list[Wave]:
        """Make the reflected or the refracted rays of a wave. Return a list with the wave of these
        rays, or an empty list if there are no such rays."""
        assert self.room is not None
        paths = name + " paths"
        self.room.clear_rays(name)
        self.room.target(paths).clear()
        query = self.gpu.query()
        with query:
            self.run(word, self.room.target(name, paths), source, tiles,
                     first_wave=not wave.depth)
        if not query.samples:
            return []
        path = self.room.samplers(paths, "path")
        self.run("live tiles", self.room.target("live tiles"), path, size=self.size)
        live = read_texture(self.room.textures("live tiles")[0])[:, :, 0] > 0
        return [Wave(self.room.rays[name], path, wave.depth + 1, rectangles_of(live))]

    def _tiles(self, wave: Wave) -> Rectangles | None:
        """Return the rectangles in which a wave has rays, or None for the whole image.

        With rectangles, also clear the shadow rays of the whole image, because later passes do not
        overwrite old shadow rays outside the rectangles."""
        if wave.corners is None:
            return None
        assert self.room is not None
        if "shadow rays" in self.room:
            self.room.clear_rays("shadow rays")
        self.room.rectangles.write(wave.corners)
        return self.room.rectangles

    def _light(self, trace: Trace, source: Samplers, wave: Wave, tiles: Rectangles | None,
               hits: Hits) -> Hits:
        """Add the light of all lights at the hits. Return the hits of the last shadow rays;
        without shadow rays, return ``hits``."""
        assert self.room is not None
        room, context = self.room, self.gpu.context
        if "kept hits" in room:
            self.run("keep hits", room.target("kept hits"), source, tiles)
            source = {**source, **room.samplers("kept hits", "hit")}
        for k, light in enumerate(self._lights[wave.depth] or [{}]):
            self.run("surfaces", room.target("shadow rays", "lit", "direct"), source, tiles,
                     **light, further_light=k > 0, corner=self.region.corner,
                     last_wave=0 < wave.depth == self.needs.bounces)
            if "shadow rays" in room:
                hits = trace(room.rays["shadow rays"], any_hit=True)
            if "radiance" in room:
                # Get the hits before blending is on: for packets, `samplers` of the hits runs a
                # pass, which must not blend.
                gathered = {**source, **hits.samplers(), **self._lit()}
                context.enable_only(moderngl.BLEND)
                context.blend_func = moderngl.ONE, moderngl.ONE
                self.run("gather", room.target("radiance"), gathered, tiles,
                         first_wave=not wave.depth)
                context.enable_only(moderngl.NOTHING)
        return hits

    def _lit(self) -> Samplers:
        assert self.room is not None
        return {name: texture for stream in ("lit", "direct") if stream in self.room
                for name, texture in self.room.samplers(stream, stream).items()}


def places_in_pixel(samples: int) -> Iterator[tuple[float, float]]:
    """Yield each sample's offset from the pixel's centre, in pixels. All pixels use equal offsets.
    If a pixel with 2^k samples is divided into 2^i columns and 2^(k - i) rows, each cell contains
    exactly one sample."""
    cells = 1 << (samples - 1).bit_length()
    for first in range(0, samples, _AT_ONCE):    # 2^24 samples in one block would need gigabytes
        points = sobol_first_two(np.arange(first, min(first + _AT_ONCE, samples),
                                           dtype=np.uint32))
        places = [reversed_bits(bits) / 2.0 ** 32 + 0.5 / cells - 0.5 for bits in points]
        yield from zip(*(place.tolist() for place in places))


def _branch(name: str, define: str) -> tuple[PixelStream, PixelStream]:
    """Return the streams of reflected or refracted rays and of their weights."""
    return (PixelStream(name, RAY_TEXELS, (define,)),
            PixelStream(name + " paths", PATH, (define,)))
