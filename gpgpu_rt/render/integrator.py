"""Integrator: a picture as passes over streams of rays, each there only where a scene needs it.

One that is new declares its ``streams`` and ``passes``, with the defines of
``render/needs.py`` that ask for them, and says in ``draw`` in which order they run. It traces
by whatever method the tracer has: ``trace(rays)`` leaves hits, ``trace(rays, any_hit=True)`` tells
whether anything is in the way.
"""
from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import moderngl
import numpy as np

from ..gl.context import Gpu
from ..gl.full_screen import FullScreenPass, Rectangles
from ..gl.precision import Precision
from ..gl.primitive_pass import PrimitivePass
from ..gl.record import EXACT_INTEGER, TABLE_WIDTH_LOG2, Record
from ..gl.textures import release
from ..methods.choices import COHERENT
from ..options import Option, resolve_options, word_define
from ..rays.eye_rays import EyeRays
from ..rays.textures import RayTextures, StateBuffer
from ..scene.camera import Camera
from ..scene.region import Region
from ..scene.scene import Scene
from ..traversal.live_tiles import TILE
from ..traversal.packet_hits import PacketHits
from .needs import CUTOFF, Asked, SceneNeeds
from .picture_streams import PixelStream, Room, held
from .scene_textures import SceneTextures

Hits = StateBuffer | PacketHits
Trace = Callable[..., Hits]     # (rays, any_hit=False) -> hits
Samplers = Mapping[str, moderngl.Texture]


@dataclass(frozen=True)
class Pass:
    """A program of an integrator.

    Attributes
    ----------
    name : how plans call it
    entry : its file in ``glsl/``
    wanted : it exists where one of these defines is set, or always
    reads, writes : records of streams, by the names they have in the program; of what is written,
        also the define without which it is not
    defines : besides those of the scene
    points : of a pass that draws points the vertex program, which reads what ``reads`` says
    """

    name: str
    entry: str
    wanted: tuple[str, ...] = ()
    reads: tuple[tuple[str, Record], ...] = ()
    writes: tuple[tuple[str, Record] | tuple[str, Record, str], ...] = ()
    defines: tuple[str, ...] = ()
    points: str = ""


ALL_FEATURES = Option(
    "all_features", False, "build the programs, textures and passes of every feature, even those "
    "that the scene does not require; the picture is the same", bool)
# Each depth of what is refracted has textures of its own, and branches double with each. Light
# through a solid of glass takes a reflection inside or two; by 8 its picture is that of 12 bounces
# to a grey level in the mean, for a third of the time.
BOUNCES = Option("bounces", 8, "largest number of successive reflections and refractions",
                 int, minimum=0, maximum=64)
LIGHT_SAMPLES = Option("light_samples", 16, "shadow rays from each visible point towards emitting "
                       "triangles; each bounce halves the number", int, minimum=1,
                       maximum=1 << 16)     # a host's list of them is made for each depth
SAMPLES = Option("samples", 1, "samples per pixel, whose light is averaged; 1: a single ray "
                 "through the centre of the pixel", int, minimum=1, maximum=EXACT_INTEGER)


class Integrator:
    """What all have in common: a scene's textures, the streams of one size, and the programs.

    Parameters
    ----------
    intersection : the triangle test, which rays are spawned clear of
    """

    name: str
    rays = COHERENT    # what most of those that it traces are
    centred = True     # its eye rays go through pixel centres: first hits can be rasterised
    passes: tuple[Pass, ...]
    options: tuple[Option, ...] = (ALL_FEATURES, BOUNCES, LIGHT_SAMPLES, SAMPLES)

    def __init__(self, gpu: Gpu, scene: Scene, needs: SceneNeeds, intersection: str) -> None:
        self.gpu, self.needs, self.intersection = gpu, needs, intersection
        self.precision = needs.asked.precision
        self.textures = SceneTextures(gpu, needs, self.precision)
        self._eye = EyeRays(gpu, self.precision)
        self._programs: dict[str, FullScreenPass | PrimitivePass] = {}
        self.drawn: Counter[str] = Counter()    # passes of this picture
        self.vertices: list[dict[str, int]] = []    # of its paths; see ``Statistics``
        self.fetches = 0                        # texels that they read, a pixel
        self.room: Room | None = None
        self.size = (0, 0)
        self.region = Region((0, 0), (0, 0), (0, 0))    # of the picture, that is drawn
        self.radiance: np.ndarray | None = None     # linear, of one that finds it
        self.samples_done = 0                       # of each pixel, by one that takes samples
        self.noise: float | None = None             # of them, once their spread tells
        # Told samples done, samples of all, and the noise so far.
        self.progress: Callable[[int, int, float], None] | None = None
        self.take(scene)

    @classmethod
    def asked(cls, options: Mapping[str, Any], precision: Precision) -> Asked:
        """What a scene's needs are to follow from, of this integrator's options."""
        given = resolve_options(options, cls.options, f"integrator {cls.name}")
        return Asked(given.get("bounces", 0), given.get("light_samples", 1), precision,
                     given["all_features"], samples=given["samples"])

    def take(self, scene: Scene) -> None:
        """Draw this scene from now on: the same one, or one whose triangles moved."""
        self.scene = scene
        self.textures.take(scene)
        self._uniforms = self.textures.uniforms(scene)
        for program in self._programs.values():
            program.set(**self._uniforms)

    def streams(self) -> tuple[PixelStream, ...]:
        """Every stream that this integrator knows for this scene, wanted or not."""
        raise NotImplementedError

    def draw(self, trace: Trace, rays: RayTextures, camera: Camera) -> np.ndarray:
        """(height, width, 3) uint8 sRGB, of an image as large as ``rays``."""
        raise NotImplementedError

    def start(self, region: Region, options: Mapping[str, Any] = {}) -> None:
        """Make room for a picture, or a region of one, and forget the last one's counts.

        ``options`` are those that were asked for; most have become needs by now.
        """
        self.region = region
        self._make_room(region.size)
        self.drawn.clear()
        self.fetches, self.vertices = 0, []
        if self.needs.want(("MOVING",)) and self.needs.asked.all_features:
            self.textures.take(self.scene)    # as whoever does not know whether it moved must

    def _make_room(self, size: tuple[int, int]) -> None:
        """Streams of (width, height) texels; those of the last picture if they fit."""
        self.size = size
        if self.room is None or self.room.size != size:
            self._release_room()
            self.room = Room(self.gpu, size, self.precision,
                             [s for s in self.streams() if self.needs.want(s.wanted)])

    def eye_rays(self, rays: RayTextures, camera: Camera,
                 aside: tuple[float, float] = (0.0, 0.0)) -> None:
        """The rays through the pixel centres, or so far beside them."""
        self._eye.write(rays, camera, self.scene.bounds, aside, self.region)
        self.drawn["eye rays"] += 1

    def run(self, name: str, target: moderngl.Framebuffer, samplers: Samplers,
            rectangles: Rectangles | None = None, points: int = 0, **uniforms: Any) -> None:
        """Draw a pass, everywhere or on rectangles, or so many points; the scene's own textures
        are at hand."""
        program = self.program(name)
        program.set(**uniforms)
        samplers = {**self.textures.samplers(), **samplers}
        if isinstance(program, PrimitivePass):
            program.draw(target, samplers, moderngl.POINTS, points)
        else:
            program.draw(target, samplers, rectangles=rectangles)
        self.drawn[name] += 1
        texels = self.textures.texels()
        self.fetches += sum(texels.get(sampler, 1) for sampler in program.samplers)

    def program(self, name: str) -> FullScreenPass | PrimitivePass:
        """The program of a pass, compiled when it is first asked for."""
        if name not in self._programs:
            declared = next(p for p in self.passes if p.name == name)
            assert self.needs.want(declared.wanted), f"{name} is not for this scene"
            texts, target = [], 0
            for stream, record, *wanted in declared.writes:
                if not self.needs.want(tuple(wanted)):
                    continue
                texts.append(self.layout(record, stream).stream_glsl(True, target))
                target += self.layout(record, stream).texels
            sources = "\n".join(self.layout(record, stream).stream_glsl(writes=False)
                                for stream, record in declared.reads)
            kind = partial(PrimitivePass, vertex=declared.points) if declared.points else (
                FullScreenPass)
            self._programs[name] = kind(
                self.gpu, declared.entry, defines={
                    "TABLE_WIDTH_LOG2": TABLE_WIDTH_LOG2, "CUTOFF": CUTOFF,
                    **self.precision.defines(), **self.defines,
                    word_define("INTERSECTION", self.intersection): True,
                    **{define: True for define in declared.defines}, "TILE": TILE},
                virtual={"streams": "\n".join([*texts, sources]), "sources": sources,
                         "tables": self.textures.tables_glsl()})
            self._programs[name].set(**self._uniforms)
        return self._programs[name]

    @property
    def packed_sizes(self) -> list[tuple[int, int]]:
        """Sizes of textures besides its own, (width, height), that it has rays of."""
        return []

    @property
    def planned(self) -> SceneNeeds:
        """The needs of a picture of this size: a program that none of its passes takes may be
        there for the next one's."""
        return self.needs

    @property
    def defines(self) -> dict[str, object]:
        """What all its programs are compiled with."""
        return self.needs.defines

    def layout(self, record: Record, name: str) -> Record:
        """A record as its textures hold it, under the name that a program gives it."""
        return replace(held(record, self.precision), name=name)

    def bytes(self) -> dict[str, int]:
        """Bytes by table, image or stream."""
        return {**self.textures.bytes(), **(self.room.bytes() if self.room else {})}

    def _release_room(self) -> None:
        release(self.room)
        self.room = None

    def release(self) -> None:
        self._release_room()
        release(self.textures, self._programs, self._eye)
