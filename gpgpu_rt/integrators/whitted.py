"""Whitted's ray tracing: light with shadows at every hit, and rays that go on where it mirrors or
lets light through (Whitted, "An Improved Illumination Model for Shaded Display", CACM 1980).

His recursion runs on the host, over whole images instead of rays: a wave is the rays of one
branch, a texel a pixel, most of them empty further down the tree of branches. An occlusion query
around the pass that makes a branch says whether any ray is in it; if none is, the branch ends
there. Rays that reflect are used up by the next wave, so two textures of them are enough; of those
that are refracted each depth keeps its own until its turn comes.
"""
from __future__ import annotations

import moderngl
import numpy as np

from ..camera import Camera
from ..ray_state import RayTextures
from ..texel_layout import DIRECT, HIT, LIT, PATH, RADIANCE, RAY_TEXELS, SCREEN
from ..textures import read_texture
from .integrator import Hits, Integrator, Pass, Samplers, Trace
from .lights import light_uniforms
from .room import Stream

_RAYS, _HIT, _PATH = ("rays", RAY_TEXELS), ("hit", HIT), ("path", PATH)
_LIT, _DIRECT, _RADIANCE = ("lit", LIT), ("direct", DIRECT), ("radiance", RADIANCE)
_BRANCH = {"reads": (_RAYS, _HIT, _PATH), "writes": (("bounce", RAY_TEXELS), ("next_path", PATH))}


class Whitted(Integrator):
    """Mirrors, dielectrics, hard shadows of points and soft ones of triangles that emit."""

    name = "whitted"
    passes = (
        Pass("surfaces", "passes/surfaces.frag", (), (_RAYS, _HIT),
             (("shadow_rays", RAY_TEXELS, "SHADOWS"), _LIT, ("direct", DIRECT, "SHADOWS"))),
        Pass("keep hits", "passes/keep_hits.frag", ("MANY_LIGHTS",), (_HIT,), (("kept", HIT),)),
        Pass("reflect", "passes/branch.frag", ("BOUNCES",), **_BRANCH),
        Pass("refract", "passes/branch.frag", ("DIELECTRICS",), **_BRANCH,
             defines=("REFRACTED",)),
        Pass("gather", "passes/gather.frag", ("GATHERED",), (_LIT, _DIRECT, _HIT, _PATH),
             (_RADIANCE,)),
        Pass("picture", "passes/picture.frag", (), (_LIT, _DIRECT, _HIT, _RADIANCE)),
    )

    def streams(self) -> tuple[Stream, ...]:
        depths = range(1, max(self.needs.bounces, 1) + 1)
        return (Stream("lit", LIT), Stream("direct", DIRECT, ("SHADOWS",)),
                Stream("shadow rays", RAY_TEXELS, ("SHADOWS",)),
                Stream("kept hits", HIT, ("MANY_LIGHTS",)),
                Stream("radiance", RADIANCE, ("GATHERED",)),
                *(s for k in depths[:2] for s in _branch(f"reflected {k % 2}", "BOUNCES")),
                *(s for k in depths for s in _branch(f"refracted {k}", "DIELECTRICS")),
                Stream("screen", SCREEN))

    def draw(self, trace: Trace, rays: RayTextures, camera: Camera) -> np.ndarray:
        assert self.room is not None
        self.eye_rays(rays, camera)
        self._lights = light_uniforms(self.scene, self.needs)
        if "radiance" in self.room:
            self.room.target("radiance").clear()
        shadows = self._wave(trace, rays, None, 0)
        source = {**self._lit(), **shadows.samplers()}
        if "radiance" in self.room:
            source.update(self.room.samplers("radiance", "radiance"))
        self.run("picture", self.room.target("screen"), source)
        return (read_texture(self.room.textures("screen")[0])[:, :, :3] * 255 + 0.5).astype(
            np.uint8)

    def _wave(self, trace: Trace, rays: RayTextures, path: Samplers | None, depth: int) -> Hits:
        """Trace the rays of a branch, add what they find, and go on with its branches; returns
        the hits traced last for its lights."""
        hits = trace(rays)
        assert self.room is not None
        first = path is None
        if path is None:     # of the first wave's none is read: any texture will do
            path = self.room.samplers("lit", "path")
        source = {**rays.samplers(), **hits.samplers(), **path}
        branches = []
        if depth < self.needs.bounces:
            branches = [name for word, name, define in (
                ("reflect", f"reflected {(depth + 1) % 2}", "BOUNCES"),
                ("refract", f"refracted {depth + 1}", "DIELECTRICS"))
                if self.needs.want((define,)) and self._branch(word, name, source, first)]
        hits = self._light(trace, source, first, hits)
        for name in branches:
            self._wave(trace, self.room.rays[name],
                       self.room.samplers(name + " paths", "path"), depth + 1)
        return hits

    def _branch(self, word: str, name: str, source: Samplers, first: bool) -> bool:
        """Make the rays that go on one way; whether there are any."""
        assert self.room is not None
        self.room.clear_rays(name)
        self.room.target(name + " paths").clear()
        query = self.gpu.context.query(samples=True)
        with query:
            self.run(word, self.room.target(name, name + " paths"), source, first_wave=first)
        return query.samples > 0

    def _light(self, trace: Trace, source: Samplers, first: bool, hits: Hits) -> Hits:
        """Add what every light gives the hits; the hits of the last shadow rays, or those given
        where nothing casts shadows."""
        assert self.room is not None
        room, context = self.room, self.gpu.context
        if "kept hits" in room:
            self.run("keep hits", room.target("kept hits"), source)
            source = {**source, **room.samplers("kept hits", "hit")}
        for k, light in enumerate(self._lights or [{}]):
            self.run("surfaces", room.target("shadow rays", "lit", "direct"), source, **light,
                     further_light=k > 0)
            if "shadow rays" in room:
                hits = trace(room.rays["shadow rays"], any_hit=True)
            if "radiance" in room:
                context.enable_only(moderngl.BLEND)
                context.blend_func = moderngl.ONE, moderngl.ONE
                self.run("gather", room.target("radiance"),
                         {**source, **hits.samplers(), **self._lit()}, first_wave=first)
                context.enable_only(moderngl.NOTHING)
        return hits

    def _lit(self) -> Samplers:
        """What shading left."""
        assert self.room is not None
        return {name: texture for stream in ("lit", "direct") if stream in self.room
                for name, texture in self.room.samplers(stream, stream).items()}


def _branch(name: str, define: str) -> tuple[Stream, Stream]:
    """The streams of rays that go on one way, and of their weights."""
    return (Stream(name, RAY_TEXELS, (define,)), Stream(name + " paths", PATH, (define,)))
