"""Integrator: draws a picture by passes over streams of rays.

A new integrator declares its ``streams`` and ``passes``, and runs the passes in ``draw``. A
scene's properties set GLSL defines (``render/needs.py``). A stream or pass may list defines in
``wanted``; it then exists only if the scene sets one of them. ``trace(rays)`` returns hits;
``trace(rays, any_hit=True)`` finds whether rays are occluded.
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
from ..gl.target import Drawable, Target
from ..gl.textures import release
from ..methods.choices import COHERENT
from ..options import Option, resolve_options, word_define
from ..rays.eye_rays import EyeRays
from ..rays.textures import RayTextures
from ..scene.camera import Camera
from ..scene.region import Region
from ..scene.scene import Scene
from ..traversal.live_tiles import TILE
from ..traversal.packet_hits import PacketHits
from .needs import CUTOFF, Asked, SceneNeeds
from .picture_streams import PictureStreams, PixelStream, held
from .scene_textures import SceneTextures
from .tone_map import EXPOSURE, TONE_MAP, is_plain, shown

Hits = Target | PacketHits
Trace = Callable[..., Hits]     # (rays, any_hit=False) -> hits
Samplers = Mapping[str, moderngl.Texture]


@dataclass(frozen=True)
class PicturePass:
    """A program of an integrator.

    Attributes
    ----------
    name : The name of the pass in plans.
    entry : The program's file in ``glsl/``.
    wanted : The pass exists if one of these defines is set, or if the tuple is empty.
    reads : The streams that the program reads, as (name in the program, record).
    writes : The streams that the program writes, as (name in the program, record) or (name,
        record, define). A stream with a define is written only if the define is set.
    defines : Further defines, beside the defines of the scene.
    points : The vertex program, which reads the streams of ``reads``, if the pass draws points;
        otherwise empty.
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
    "that the scene does not require; the picture is the same", bool, label="build every feature")
# The default is small, because each depth of refraction needs its own textures and doubles the
# branches. Light usually leaves solid glass after one or two inner reflections.
BOUNCES = Option("bounces", 8, "largest number of successive reflections and refractions",
                 int, minimum=0, maximum=64, label="most bounces")
LIGHT_SAMPLES = Option("light_samples", 16, "shadow rays from each visible point towards emitting "
                       "triangles; each bounce halves the number", int, minimum=1,
                       maximum=1 << 16,     # the host makes a list of this length for each depth
                       label="shadow rays to lamps")
SAMPLES = Option("samples", 1, "samples per pixel, whose light is averaged; 1: a single ray "
                 "through the centre of the pixel", int, minimum=1, maximum=EXACT_INTEGER,
                 common=True, label="samples per pixel")


class Integrator:
    """The base class of integrators: the scene's textures, the streams for one size of picture,
    and the programs.

    Parameters
    ----------
    gpu : the OpenGL context
    scene : the scene to draw
    needs : the properties to support, the bounces and the shadow rays of a picture of the scene
    intersection : the triangle test; the origins of spawned rays depend on its errors
    """

    name: str
    rays = COHERENT    # whether most rays of this integrator are coherent or incoherent
    centred = True     # eye rays go through pixel centres, so first hits can be rasterised
    passes: tuple[PicturePass, ...]
    options: tuple[Option, ...] = (ALL_FEATURES, BOUNCES, LIGHT_SAMPLES, SAMPLES,
                                   EXPOSURE, TONE_MAP)

    def __init__(self, gpu: Gpu, scene: Scene, needs: SceneNeeds, intersection: str) -> None:
        self.gpu, self.needs, self.intersection = gpu, needs, intersection
        self.precision = needs.asked.precision
        self.textures = SceneTextures(gpu, needs, self.precision)
        self._eye = EyeRays(gpu, self.precision)
        self._programs: dict[str, FullScreenPass | PrimitivePass] = {}
        self.drawn: Counter[str] = Counter()    # number of passes of this picture by name
        self.vertices: list[dict[str, int]] = []    # counts for each path vertex; see `Statistics`
        self.fetches = 0                        # texels that all passes read, per pixel
        self.room: PictureStreams | None = None
        self.size = (0, 0)
        self.region = Region((0, 0), (0, 0), (0, 0))    # the region of the picture that is drawn
        self.radiance: np.ndarray | None = None     # linear, if the integrator computes it
        self.samples_done = 0                       # samples per pixel so far
        self.noise: float | None = None             # relative noise, if there are enough samples
        self.given: dict[str, Any] = {}             # the value of each option
        # Called with the samples done, the samples in total, and the noise so far.
        self.progress: Callable[[int, int, float], None] | None = None
        self.take(scene)

    @classmethod
    def asked(cls, options: Mapping[str, Any], precision: Precision) -> Asked:
        """Return the options of this integrator on which the needs of a scene depend."""
        given = resolve_options(options, cls.options, f"integrator {cls.name}")
        return Asked(given.get("bounces", 0), given.get("light_samples", 1), precision,
                     given["all_features"], samples=given["samples"])

    def take(self, scene: Scene) -> None:
        """Use this scene from now on. Later calls pass the same scene with moved triangles."""
        self.scene = scene
        self.textures.take(scene)
        self._uniforms = self.textures.uniforms(scene)
        for program in self._programs.values():
            program.set(**self._uniforms)

    def streams(self) -> tuple[PixelStream, ...]:
        """Return all declared streams, including those that the scene does not need."""
        raise NotImplementedError

    def draw(self, trace: Trace, rays: RayTextures, camera: Camera) -> np.ndarray:
        """Draw a picture of the size of ``rays``; return (height, width, 3) uint8 sRGB."""
        raise NotImplementedError

    def start(self, region: Region, options: Mapping[str, Any] = {}) -> None:
        """Allocate the streams for a region of a picture, and reset the counts."""
        self.given = resolve_options(options, self.options, f"integrator {self.name}")
        self.region = region
        self._make_room(region.size)
        self.drawn.clear()
        self.fetches, self.vertices = 0, []
        if self.needs.want(("MOVING",)) and self.needs.asked.all_features:
            # A scene that starts to move sets MOVING, and so gets a new integrator with new
            # tables. With all_features, MOVING is always set, so write the tables again here.
            self.textures.take(self.scene)

    @property
    def is_plain(self) -> bool:
        """Whether the picture is shown without an exposure and a tone curve."""
        return is_plain(self.given["exposure"], self.given["tone_map"])

    def show(self, light: np.ndarray) -> np.ndarray:
        """Return linear light, (height, width, 3) float64, as uint8 sRGB by the options
        ``exposure`` and ``tone_map``."""
        return shown(light, self.given["exposure"], self.given["tone_map"])

    def _make_room(self, size: tuple[int, int]) -> None:
        self.size = size
        if self.room is None or self.room.size != size:
            self._release_room()
            self.room = PictureStreams(self.gpu, size, self.precision,
                                       [s for s in self.streams() if self.needs.want(s.wanted)])

    def eye_rays(self, rays: RayTextures, camera: Camera,
                 aside: tuple[float, float] = (0.0, 0.0)) -> None:
        """Write the rays through the pixel centres, offset by ``aside``, in pixels."""
        self._eye.write(rays, camera, self.scene.bounds, aside, self.region)
        self.drawn["eye rays"] += 1

    def run(self, name: str, target: Drawable, samplers: Samplers,
            rectangles: Rectangles | None = None, points: int = 0, **uniforms: Any) -> None:
        """Run a pass over the whole target or over rectangles, or draw ``points`` points. The
        scene's textures are bound beside ``samplers``."""
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
        """Return the program of a pass, compiled at its first use."""
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
        """Further sizes, (width, height), of ray textures that the integrator traces."""
        return []

    @property
    def planned(self) -> SceneNeeds:
        """The needs of a picture of the current size. `needs` may include more: features that only
        pictures of other sizes use."""
        return self.needs

    @property
    def defines(self) -> dict[str, object]:
        """The defines of all programs of this integrator."""
        return self.needs.defines

    def layout(self, record: Record, name: str) -> Record:
        """Return a record in the precision of its textures, with the name that a program uses."""
        return replace(held(record, self.precision), name=name)

    def bytes(self) -> dict[str, int]:
        """Return the bytes of each table, image and stream, by name."""
        return {**self.textures.bytes(), **(self.room.bytes() if self.room else {})}

    def _release_room(self) -> None:
        release(self.room)
        self.room = None

    def release(self) -> None:
        self._release_room()
        release(self.textures, self._programs, self._eye)
