"""Workloads: makes and caches the rays that measurements trace.

Bounced rays are made from the hits of the rays before the bounce.
"""
from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..accel.bounds import unit_normals
from ..hits import Hits
from ..numerics.error_bounds import FLOAT32
from ..rays.ray_sets import random_rays
from ..reference.spawn import spawn
from ..scene.loading import load_scene
from ..scene.scene import Scene
from ..tracer import Tracer

EYE, SHADOW, MIRROR, DIFFUSE = "eye rays", "shadow rays", "mirror rays", "diffuse rays"
RANDOM = "random rays"
RAY_SETS = {"eye": EYE, "shadow": SHADOW, "mirror": f"{MIRROR} 1", "diffuse": f"{DIFFUSE} 1",
            "random": RANDOM}   # the names on the command line of the bench
SEED = 7    # seed of the directions of diffuse bounces, and of random rays
# A shadow ray ends at this share of the distance to the light, as in glsl/render/light_end.glsl.
_BEFORE_LIGHT = np.float32(1 - 12 * FLOAT32.unit)


@dataclass(frozen=True)
class Workload:
    """The rays of all or some pixels of an image, row by row; NaN marks a pixel without a ray.

    Attributes
    ----------
    origins, directions : (n, 3) float32
    size : side of the square image in pixels; the whole image has n = size squared rays
    t_max : (n,) float32, the end of each ray; None if rays have no end
    any_hit : whether any hit is enough, as for shadow rays
    shape : (h, w) of a part of the image; None for the whole image
    t_min : (n,) float32, the start of each ray; None if rays start at their origins. The engines
        of engines.py ignore ``t_min``
    """

    origins: np.ndarray
    directions: np.ndarray
    size: int
    t_max: np.ndarray | None = None
    any_hit: bool = False
    shape: tuple[int, int] | None = None
    t_min: np.ndarray | None = None

    @functools.cached_property
    def has_ray(self) -> np.ndarray:
        """(n,) bool, whether each pixel has a ray. A tracer treats a pixel without a ray as a
        miss. The engines of engines.py get only pixels with a ray."""
        return ((np.isfinite(self.origins) & np.isfinite(self.directions)).all(axis=1)
                & self.directions.any(axis=1))

    @property
    def live(self) -> int:
        """The number of pixels with a ray."""
        return int(self.has_ray.sum())

    @property
    def ends(self) -> np.ndarray:
        """(n,) float32, the end of each ray; inf for a ray without an end."""
        if self.t_max is None:
            return np.full(len(self.origins), np.inf, np.float32)
        return self.t_max

    def compact(self, most: int | None = None, tile: tuple[int, int] = (1, 1)) -> Workload:
        """Return only the pixels with a ray, at most ``most`` of them, evenly spread.

        The rays are in the order of the image's tiles of ``tile`` pixels (width, height).
        """
        live = np.flatnonzero(self.has_ray)
        if tile != (1, 1):
            y, x = np.divmod(live, self.size)
            live = live[np.lexsort((x % tile[0], y % tile[1], x // tile[0], y // tile[1]))]
        if most is not None and len(live) > most:
            live = live[np.linspace(0, len(live) - 1, most).astype(np.int64)]
        return Workload(*(np.ascontiguousarray(a[live], np.float32)
                          for a in (self.origins, self.directions)), self.size,
                        None if self.t_max is None else self.t_max[live], self.any_hit,
                        t_min=None if self.t_min is None else self.t_min[live])

    def part(self, pixels: np.ndarray) -> Workload:
        """Return the rays of the pixels with the indices ``pixels``, (h, w) int."""
        chosen = pixels.reshape(-1)
        return Workload(self.origins[chosen], self.directions[chosen], self.size,
                        None if self.t_max is None else self.t_max[chosen], self.any_hit,
                        pixels.shape, None if self.t_min is None else self.t_min[chosen])

    def trace(self, tracer: Tracer) -> Hits | None:
        """Trace the rays and return their hits, or None if any hit is enough."""
        shape = self.shape or (self.size, self.size)
        t_max = np.inf if self.t_max is None else self.t_max
        t_min = 0.0 if self.t_min is None else self.t_min
        trace = tracer.occluded if self.any_hit else tracer.trace
        found = trace(self.origins, self.directions, t_min=t_min, t_max=t_max, shape=shape,
                      invalid="miss")
        return found if isinstance(found, Hits) else None


def mirror(bounces: int) -> str:
    """Return the name of the rays after ``bounces`` mirror bounces."""
    return bounced(MIRROR, bounces)


def diffuse(bounces: int) -> str:
    """Return the name of the rays after ``bounces`` diffuse bounces."""
    return bounced(DIFFUSE, bounces)


def bounced(kind: str, bounces: int) -> str:
    """Return the name of the rays after ``bounces`` bounces of a kind; 0 bounces are eye rays."""
    return f"{kind} {bounces}" if bounces else EYE


def told(name: str) -> str:
    """Return a workload's name for use in a sentence: "mirror rays 1" becomes "mirror rays"."""
    return name.removesuffix(" 1")


@functools.lru_cache(maxsize=8)
def workload(scene: str, name: str, size: int) -> Workload:
    """Return the workload with this name, for an image of ``size`` x ``size`` pixels.

    The names are ``eye rays``, ``shadow rays``, ``mirror rays 2``, ``diffuse rays 2`` (the
    number counts bounces) and ``random rays``. For mirror rays, all surfaces are mirrors; for
    diffuse rays, all are diffuse. A random ray starts at a random point in the scene's box and has
    a random direction.
    """
    return _made(load(scene), name, size, lambda before: (
        workload(scene, before, size), _hits(scene, before, size)))


def rays_of(scene: Scene, name: str, size: int) -> Workload:
    """Return what `workload` returns, for a scene that has no name. Nothing is cached, so the
    scene's camera and lights may change between two calls."""
    def seen(before: str) -> tuple[Workload, Hits]:
        rays = rays_of(scene, before, size)
        return rays, _traced(scene, rays)
    return _made(scene, name, size, seen)


def _made(scene: Scene, name: str, size: int,
          seen: Callable[[str], tuple[Workload, Hits]]) -> Workload:
    """Return the workload with this name. ``seen`` returns a workload by name, with its hits: the
    rays before a bounce, or the eye rays before shadow rays."""
    if name == EYE:
        origins, directions = scene.camera.rays((size, size))
        return Workload(origins.reshape(-1, 3), directions.reshape(-1, 3), size)
    if name == RANDOM:
        return Workload(*random_rays(scene, size * size, SEED), size)
    if name == SHADOW:
        return _shadows(scene, *seen(EYE))
    for kind, bounce in ((MIRROR, _mirrored), (DIFFUSE, _scattered)):
        if name.startswith(kind):
            return bounce(scene, *seen(bounced(kind, int(name.removeprefix(kind)) - 1)))
    raise ValueError(f"no workload {name!r}")


def _shadows(scene: Scene, seen: Workload, hits: Hits) -> Workload:
    """Return a ray to the light from each hit whose surface faces the light; NaN elsewhere."""
    light = np.asarray(scene.light.position, np.float32)
    points, normals = _surfaces(scene, seen, hits)
    towards = light - points
    lit = hits.hit & ((normals * towards).sum(axis=1) > 0)
    origins = np.where(lit[:, None], spawn(scene, hits, towards), np.float32(np.nan))
    towards = light - origins
    distance = np.linalg.norm(towards, axis=1, keepdims=True)
    return Workload(origins, towards / distance, seen.size,
                    np.where(lit, distance[:, 0] * _BEFORE_LIGHT, np.float32(0)), True)


def _mirrored(scene: Scene, seen: Workload, hits: Hits) -> Workload:
    normals = _surfaces(scene, seen, hits)[1]
    along = (seen.directions * normals).sum(axis=1, keepdims=True)
    directions = seen.directions - np.float32(2) * along * normals
    return Workload(spawn(scene, hits, directions), directions, seen.size)


def _scattered(scene: Scene, seen: Workload, hits: Hits) -> Workload:
    """Return a ray from each hit in a random direction, with cosine-weighted probability."""
    normals = _surfaces(scene, seen, hits)[1]
    directions = np.random.default_rng(SEED).normal(size=normals.shape)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions = (0.999 * directions + normals).astype(np.float32)
    return Workload(spawn(scene, hits, directions), directions, seen.size)


def _surfaces(scene: Scene, seen: Workload, hits: Hits) -> tuple[np.ndarray, np.ndarray]:
    """Return hit points and unit normals that face the ray's origin, (n, 3) each; NaN for a
    miss."""
    points = np.full_like(seen.origins, np.nan)
    normals = points.copy()
    some = np.flatnonzero(hits.hit)
    corners = scene.triangles[hits.triangle[some]]
    points[some] = seen.origins[some] + hits.t[some, None] * seen.directions[some]
    facing = unit_normals(corners)
    away = (facing * seen.directions[some]).sum(axis=1, keepdims=True) > 0
    normals[some] = np.where(away, -facing, facing)
    return points, normals


@functools.lru_cache(maxsize=8)
def _hits(scene: str, name: str, size: int) -> Hits:
    return _traced(load(scene), workload(scene, name, size))


def _traced(scene: Scene, rays: Workload) -> Hits:
    """Trace a workload with kd-short-stack, because other kd-tree methods can reuse the cached
    tree."""
    with Tracer(scene, "kd-short-stack") as tracer:
        found = rays.trace(tracer)
    assert found is not None
    return found


@functools.lru_cache(maxsize=2)
def load(name: str) -> Scene:
    """Return a scene by name; the two most recent scenes stay in memory."""
    return load_scene(name)
