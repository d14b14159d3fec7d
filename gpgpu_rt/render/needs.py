"""Needs: the table that decides which programs, textures and passes a picture needs.

Each row of ``PROPERTIES`` says how to detect a property of scenes, which defines and tables the
property adds, and what to tell the user if it is absent. Streams and passes of integrators declare
which defines they need (``render/integrator.py``). To add a property, add a row.
"""
from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..accel.bounds import unit_normals
from ..gl.lazy_field import Column
from ..gl.precision import Precision
from ..gl.record import Record
from ..scene.image_light import ImageLight
from ..scene.light_choice import LightChoice, asks_surroundings
from ..scene.scene import Scene
from ..traversal.triangle_table import TRIANGLE, triangle_table
from .images import places
from .records import (
    COLOUR, CORNER_NORMALS, CORNER_UV, DIELECTRIC, EMISSION, GLOSSY, IMAGE, LIGHT_CHOICE, MIRROR,
    POINT_LIGHT, SURFACE, SURROUNDINGS_ROW
)

# Whitted's ray tracing follows a ray only while its weight in a pixel is at least CUTOFF. Dropped
# rays change a channel of an 8 bit picture by at most a quarter of a step, unless they find light
# brighter than white.
CUTOFF = 1 / 1024


@dataclass(frozen=True)
class Asked:
    """The options of a picture that affect the needs of its scene.

    Attributes
    ----------
    bounces : the largest number of consecutive reflections and refractions
    light_samples : the number of points on emitting triangles, for all triangles together
    precision : the precision of textures and arithmetic
    all_features : whether to treat the scene as if it had every property
    paths : whether to trace paths, which sample one light at each vertex and continue from any
        surface
    sampler : the random numbers of paths, "sobol" or "random"
    samples : the number of pictures that are averaged; 1 with paths, because their integrator
        averages samples itself
    packs : whether live paths may be packed into smaller textures
    """

    bounces: int = 0
    light_samples: int = 1
    precision: Precision = Precision()
    all_features: bool = False
    paths: bool = False
    sampler: str = "random"
    samples: int = 1
    packs: bool = False


@dataclass(frozen=True)
class Table:
    """A table that a picture's programs read: its record, and a function that makes the record's
    arrays from a scene.

    A ``geometric`` table changes when vertices move, and has the format of the option ``storage``.
    """

    record: Record
    pack: Callable[[Scene], Mapping[str, Any]]
    geometric: bool = False


@dataclass(frozen=True)
class Property:
    """A property of a scene that the renderer must support.

    Attributes
    ----------
    name : the property's name in plans
    found : returns whether a scene has the property
    absent : what a plan says about a scene without the property
    defines : the defines that the property sets in programs
    tables : the tables that programs then read
    images : further textures: "images" of materials, "surroundings_image", "surroundings_sums"
    bouncing : whether the property matters only with bounces
    of_paths : whether the property matters only if paths are traced
    of_request : whether the property depends only on the picture's options
    """

    name: str
    found: Callable[[Scene, Asked], bool]
    absent: str
    defines: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    images: tuple[str, ...] = ()
    bouncing: bool = False
    of_paths: bool = False
    of_request: bool = False


def _some(has: Callable[[Any], Any]) -> Callable[[Scene, Asked], bool]:
    """Return a test of scenes: whether ``has`` is true for a material in use."""
    return lambda scene, asked: any(has(material) for material in scene.used_materials)


def _kind(kind: str) -> Callable[[Scene, Asked], bool]:
    return lambda scene, asked: (scene.environment is not None and scene.environment.emits
                                 and scene.environment.kind == kind)


SURFACES = Table(SURFACE, lambda scene: {
    "normal": Column(len(scene), lambda rows: unit_normals(scene.triangles[rows])),
    "material": scene.material_of})
# Hits name triangles in the scene's order, but the tracer's triangle table is in its method's
# order. Programs that start rays on a hit triangle therefore read a second table.
LEFT_SURFACES = Table(TRIANGLE, lambda scene: triangle_table(scene.triangles)[TRIANGLE.name],
                      geometric=True)
_MIRROR = Table(MIRROR, lambda scene: {"share": [m.mirror for m in scene.materials]})
_DIELECTRIC = Table(DIELECTRIC, lambda scene: {"ior": [m.ior or 0.0 for m in scene.materials]})
_GLOSSY = Table(GLOSSY, lambda scene: {"share": [m.glossy for m in scene.materials],
                                       "exponent": [m.exponent for m in scene.materials]})
_EMISSION = Table(EMISSION, lambda scene: {"radiance": [m.emission for m in scene.materials]})


_LIGHT_CHOICE = Table(LIGHT_CHOICE, lambda scene: LightChoice.of(scene).choices())
_POINT_LIGHT = Table(POINT_LIGHT, lambda scene: LightChoice.of(scene).points(scene.lights))


def image_light(scene: Scene) -> ImageLight | None:
    """Return the sampling table of the image that surrounds a scene, or None."""
    return None if scene.environment is None else scene.environment.image_light


def _surroundings_row(scene: Scene) -> Mapping[str, Any]:
    light = image_light(scene)
    return {"sum": [1.0] if light is None else light.rows,
            "cosine": [1.0] if light is None else light.cosine}


def _corner_normals(scene: Scene) -> Mapping[str, Any]:
    zeros = np.zeros((len(scene), 3), np.float32)
    return {f"n{k}": zeros if scene.normals is None else scene.normals[:, k] for k in range(3)}


def _corner_uv(scene: Scene) -> Mapping[str, Any]:
    zeros = np.zeros((len(scene), 2), np.float32)
    return {f"uv{k}": zeros if scene.uv is None else scene.uv[:, k] for k in range(3)}


def light_count(scene: Scene, asked: Asked) -> int:
    """Return the number of shadow rays of a hit."""
    points = sum(any(light.intensity) for light in scene.lights)
    return points + (asked.light_samples if len(scene.emitters) else 0)


PROPERTIES: tuple[Property, ...] = (
    Property("colours", lambda scene, asked: bool((scene.colours != scene.colours[:1]).any()),
             "all triangles have one colour", ("COLOURS",),
             (Table(COLOUR, lambda scene: {"diffuse": scene.colours}),)),
    Property("materials", lambda scene, asked: len({
        (m.mirror, m.glossy, m.roughness, m.ior, m.emission, m.texture)
        for m in scene.used_materials}) > 1, "materials differ only in colour", ("MATERIALS",)),
    Property("smooth normals", lambda scene, asked: scene.normals is not None,
             "the mesh has no normals", ("SMOOTH_NORMALS",),
             (Table(CORNER_NORMALS, _corner_normals),)),
    Property("textures", _some(lambda m: m.texture is not None), "no material has a texture",
             ("TEXTURES",), (Table(CORNER_UV, _corner_uv), Table(IMAGE, places)), ("images",)),
    Property("emitters", _some(lambda m: m.emits), "no material emits light", ("EMITTERS",),
             (_EMISSION,)),
    Property("glossy", _some(lambda m: any(m.glossy)), "no material is glossy", ("GLOSSY",),
             (_GLOSSY,)),
    Property("point lights", lambda scene, asked: any(any(li.intensity) for li in scene.lights),
             "there is no point light", ("POINT_LIGHTS", "SHADOWS"), (LEFT_SURFACES,)),
    Property("area lights", lambda scene, asked: bool(len(scene.emitters)),
             "no triangle emits light", ("AREA_LIGHTS", "SHADOWS"), (LEFT_SURFACES,)),
    Property("several lights", lambda scene, asked: light_count(scene, asked) > 1,
             "a hit needs at most one shadow ray", ("MANY_LIGHTS", "GATHERED")),
    Property("several samples", lambda scene, asked: asked.samples > 1,
             "the picture is drawn once", ("GATHERED",), of_request=True),
    Property("mirrors", _some(lambda m: any(m.mirror)), "no material is a mirror",
             ("MIRRORS", "BOUNCES", "GATHERED"), (_MIRROR, LEFT_SURFACES), bouncing=True),
    Property("dielectrics", _some(lambda m: m.ior is not None), "no material lets light through",
             ("DIELECTRICS", "BOUNCES", "GATHERED"), (_DIELECTRIC, LEFT_SURFACES), bouncing=True),
    Property("backdrop", _kind("backdrop"), "no backdrop surrounds the scene", ("BACKDROP",)),
    Property("sky", _kind("sky"), "no sky of two colours surrounds the scene", ("SKY",)),
    Property("environment image", _kind("image"), "no image surrounds the scene", ("SKY_IMAGE",),
             images=("surroundings_image",)),
    Property("moving", lambda scene, asked: scene.moving, "the triangles do not move",
             ("MOVING",)),
    Property("paths", lambda scene, asked: True, "", ("PATHS",), (LEFT_SURFACES,), of_paths=True,
             of_request=True),
    Property("lights to sample", lambda scene, asked: light_count(scene, asked) > 0,
             "there is no light to sample", ("ASKED_LIGHTS",), (_LIGHT_CHOICE,), of_paths=True),
    Property("points to sample",
             lambda scene, asked: any(any(li.intensity) for li in scene.lights),
             "there is no point light", ("ASKED_POINTS",), (_POINT_LIGHT,), of_paths=True),
    Property("surroundings to sample", lambda scene, asked: asks_surroundings(scene),
             "no image surrounds the scene, and the scene is not lit by a sky alone",
             ("ASKED_SURROUNDINGS", "ASKED_LIGHTS", "SHADOWS"), (_LIGHT_CHOICE,), of_paths=True),
    Property("image to sample", _kind("image"), "no image surrounds the scene", ("ASKED_IMAGE",),
             (Table(SURROUNDINGS_ROW, _surroundings_row),), ("surroundings_sums",), of_paths=True),
    Property("packed paths", lambda scene, asked: asked.packs, "paths are not packed",
             ("PACKED_PATHS",), of_paths=True, of_request=True),
)


@dataclass(frozen=True)
class SceneNeeds:
    """The needs of a scene: the properties that programs must support, the bounces, and the shadow
    rays of a hit.

    Attributes
    ----------
    present : names of the properties that the programs support
    left_out : names of all other properties
    bounces : the number of bounces after which a ray may still change the picture
    lights : the number of shadow rays of a hit
    index_bits : bits of the largest triangle index
    asked : the options of the picture
    """

    present: tuple[str, ...]
    left_out: tuple[str, ...]
    bounces: int
    lights: int
    index_bits: int
    asked: Asked

    @classmethod
    def of(cls, scene: Scene, asked: Asked = Asked()) -> SceneNeeds:
        """Derive the needs of a scene for a picture with the options ``asked``."""
        present = [p.name for p in PROPERTIES
                   if (asked.all_features or p.found(scene, asked))
                   and (asked.bounces or not p.bouncing) and (asked.paths or not p.of_paths)]
        defines = _defines(present)
        if asked.paths:     # paths continue from any surface, and sample one light at each vertex
            bounces, lights = asked.bounces, int("ASKED_LIGHTS" in defines)
        else:
            bounces = _bounces(scene, asked) if "BOUNCES" in defines else 0
            lights = light_count(scene, asked)
        return cls(tuple(present), _but(present), bounces, lights,
                   max(len(scene) - 1, 1).bit_length(), asked)

    def without(self, name: str) -> SceneNeeds:
        """Return the needs without a property."""
        present = tuple(other for other in self.present if other != name)
        return replace(self, present=present, left_out=_but(present))

    @property
    def defines(self) -> dict[str, object]:
        """The defines of the programs."""
        return {define: True for define in _defines(self.present)}

    @property
    def tables(self) -> tuple[Table, ...]:
        """The tables that programs read, each once."""
        tables = {SURFACE.name: SURFACES}
        for p in self._rows(self.present):
            tables.update({table.record.name: table for table in p.tables})
        return tuple(tables.values())

    @property
    def images(self) -> tuple[str, ...]:
        """The textures that programs read beside tables."""
        return tuple(image for p in self._rows(self.present) for image in p.images)

    def want(self, defines: tuple[str, ...]) -> bool:
        """Return whether one of the defines is set, or no define is given."""
        return not defines or any(define in self.defines for define in defines)

    def why_not(self, *, define: str | None = None, table: str | None = None,
                image: str | None = None) -> str:
        """Return the reason why a define, a table or an image was left out."""
        reasons = [self.reason(p) for p in PROPERTIES
                   if define in p.defines or image in p.images
                   or table in [t.record.name for t in p.tables]]
        return " and ".join(dict.fromkeys(reasons))

    def reason(self, p: Property) -> str:
        """Return the reason why a property is left out."""
        if p.of_paths and not self.asked.paths:
            return "no paths are traced"
        return "no bounces are followed" if p.bouncing and not self.asked.bounces else p.absent

    @staticmethod
    def _rows(names: tuple[str, ...]) -> list[Property]:
        return [p for p in PROPERTIES if p.name in names]


def _but(names: Iterable[str]) -> tuple[str, ...]:
    kept = set(names)
    return tuple(p.name for p in PROPERTIES if p.name not in kept)


def every_define() -> tuple[str, ...]:
    """Return the defines of all properties."""
    return _defines([p.name for p in PROPERTIES])


def _defines(names: Any) -> tuple[str, ...]:
    return tuple(dict.fromkeys(d for p in PROPERTIES if p.name in names for d in p.defines))


def _bounces(scene: Scene, asked: Asked) -> int:
    """Return the largest number of bounces, up to the option ``bounces``, after which a ray's
    weight may still reach CUTOFF."""
    if asked.all_features or any(m.ior is not None for m in scene.used_materials):
        return asked.bounces
    share = max((max(m.mirror) for m in scene.used_materials), default=0.0)
    if not 0 < share < 1:
        return asked.bounces if share else 0
    # Allow for rounding in the shaders.
    return min(asked.bounces, math.floor(math.log(CUTOFF) / math.log(share) + 1e-3))
