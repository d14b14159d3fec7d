"""Whitted's ray tracing: light with shadows at every hit, and rays that go on where it mirrors or
lets light through (Whitted, "An Improved Illumination Model for Shaded Display", CACM 1980).

His recursion runs on the host, over whole images instead of rays: a wave is the rays of one
branch, a texel a pixel, most of them empty further down the tree of branches. An occlusion query
around the pass that makes a branch says whether any ray is in it; if none is, the branch ends
there, else its passes are drawn on the tiles of the image that hold some. Rays that reflect are
used up by the next wave, so two textures of them are enough; of those that are refracted each
depth keeps its own until its turn comes.
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
from .integrator import Hits, Integrator, Pass, Samplers, Trace
from .lights import light_uniforms
from .picture_streams import PixelStream
from .records import DIRECT, LIT, LIVE, PATH, RADIANCE, SCREEN

_AT_ONCE = 1 << 12     # places in a pixel
_RAYS, _HIT, _PATH = ("rays", RAY_TEXELS), ("hit", HIT), ("path", PATH)
_LIT, _DIRECT, _RADIANCE = ("lit", LIT), ("direct", DIRECT), ("radiance", RADIANCE)
_BRANCH = {"reads": (_RAYS, _HIT, _PATH), "writes": (("bounce", RAY_TEXELS), ("next_path", PATH))}


@dataclass(frozen=True)
class Wave:
    """The rays of one branch.

    Attributes
    ----------
    path : the texture of their weights; of eye rays, which weigh 1, any: it is not read
    depth : how often they have turned
    corners : (n, 4), the rectangles of the image that hold some, in texels; None for all
    """

    rays: RayTextures
    path: Samplers
    depth: int = 0
    corners: np.ndarray | None = None


class Whitted(Integrator):
    """Mirrors, dielectrics, hard shadows of points and soft ones of triangles that emit."""

    name = "whitted"
    _ended = False      # whether rays were followed up to the limit that was asked for
    passes = (
        Pass("surfaces", "render/surfaces.frag", (), (_RAYS, _HIT, _PATH),
             (("shadow_rays", RAY_TEXELS, "SHADOWS"), _LIT, ("direct", DIRECT, "SHADOWS"))),
        Pass("keep hits", "render/keep_hits.frag", ("MANY_LIGHTS",), (_HIT,), (("kept", HIT),)),
        Pass("reflect", "render/branch.frag", ("BOUNCES",), **_BRANCH),
        Pass("refract", "render/branch.frag", ("DIELECTRICS",), **_BRANCH,
             defines=("REFRACTED",)),
        Pass("live tiles", "render/path_tiles.frag", ("BOUNCES",), (_PATH,), (("live", LIVE),)),
        Pass("gather", "render/gather.frag", ("GATHERED",), (_LIT, _DIRECT, _HIT, _PATH),
             (_RADIANCE,)),
        Pass("picture", "render/picture.frag", (), (_LIT, _DIRECT, _HIT, _RADIANCE)),
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
            # Where rays go on, programs want something bound even for the eye's.
            unread = (stream_samplers("path", rays.textures[:1])
                      if self.needs.want(("BOUNCES",)) else {})
            shadows = self._wave(trace, Wave(rays, unread))
            if samples > 1:
                self.samples_done = sample + 1
                if self.progress is not None:
                    self.progress(sample + 1, samples, np.inf)
        if self._ended:
            warnings.warn(f"rays are followed for {self.needs.bounces} bounces; what surrounds "
                          "the scene shows in mirrors and glass met after that; --bounces "
                          "(Python: bounces) follows rays further", stacklevel=6)
        source, shared = {**self._lit(), **shadows.samplers()}, {}
        if "radiance" in self.room:
            source.update(self.room.samplers("radiance", "radiance"))
            shared["sample_share"] = 1 / samples
        self.run("picture", self.room.target("screen"), source, **shared)
        return (read_texture(self.room.textures("screen")[0])[:, :, :3] * 255 + 0.5).astype(
            np.uint8)

    def _wave(self, trace: Trace, wave: Wave) -> Hits:
        """Trace the rays of a branch, add what they find, and go on with its branches; returns
        the hits traced last for its lights."""
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
        """Make the rays that go on one way; a wave of them, if there are any."""
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
        """Where a wave has rays; shadow rays of the last one are gone from everywhere else."""
        if wave.corners is None:
            return None
        assert self.room is not None
        if "shadow rays" in self.room:
            self.room.clear_rays("shadow rays")
        self.room.rectangles.write(wave.corners)
        return self.room.rectangles

    def _light(self, trace: Trace, source: Samplers, wave: Wave, tiles: Rectangles | None,
               hits: Hits) -> Hits:
        """Add what every light gives the hits; the hits of the last shadow rays, or those given
        where nothing casts shadows."""
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
                # Asked for before blending begins: packets hand their hits back by a pass.
                gathered = {**source, **hits.samplers(), **self._lit()}
                context.enable_only(moderngl.BLEND)
                context.blend_func = moderngl.ONE, moderngl.ONE
                self.run("gather", room.target("radiance"), gathered, tiles,
                         first_wave=not wave.depth)
                context.enable_only(moderngl.NOTHING)
        return hits

    def _lit(self) -> Samplers:
        """What shading left."""
        assert self.room is not None
        return {name: texture for stream in ("lit", "direct") if stream in self.room
                for name, texture in self.room.samplers(stream, stream).items()}


def places_in_pixel(samples: int) -> Iterator[tuple[float, float]]:
    """Where in a pixel its samples are, beside the middle, in pixels: of 2^k samples one in each
    box of area 2^-k, the same in all pixels."""
    cells = 1 << (samples - 1).bit_length()
    for first in range(0, samples, _AT_ONCE):    # all at once of 2^24 would take gigabytes
        points = sobol_first_two(np.arange(first, min(first + _AT_ONCE, samples),
                                           dtype=np.uint32))
        places = [reversed_bits(bits) / 2.0 ** 32 + 0.5 / cells - 0.5 for bits in points]
        yield from zip(*(place.tolist() for place in places))


def _branch(name: str, define: str) -> tuple[PixelStream, PixelStream]:
    """The streams of rays that go on one way, and of their weights."""
    return (PixelStream(name, RAY_TEXELS, (define,)),
            PixelStream(name + " paths", PATH, (define,)))
