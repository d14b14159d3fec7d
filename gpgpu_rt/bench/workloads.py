"""Workloads: the rays that are measured, each made once from the hits of those before."""
from __future__ import annotations

import functools
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
            "random": RANDOM}   # what the bench calls them
SEED = 7    # of directions that diffuse surfaces choose, and of random rays
_BEFORE_LIGHT = np.float32(1 - 12 * FLOAT32.unit)   # as render/surfaces.frag ends shadow rays


@dataclass(frozen=True)
class Workload:
    """Rays of an image, row by row; a pixel that has none holds NaN.

    Attributes
    ----------
    origins, directions : (n, 3) float32
    size : pixels a side, n = size squared
    t_max : (n,) float32, where each ray ends; or None, without an end
    any_hit : whether the first hit found answers
    shape : (h, w) of a part of the image, or None: all of it
    """

    origins: np.ndarray
    directions: np.ndarray
    size: int
    t_max: np.ndarray | None = None
    any_hit: bool = False
    shape: tuple[int, int] | None = None

    @functools.cached_property
    def has_ray(self) -> np.ndarray:
        """(n,) bool, which pixels have a ray: a tracer takes the others for misses, engines are
        not given them."""
        return ((np.isfinite(self.origins) & np.isfinite(self.directions)).all(axis=1)
                & self.directions.any(axis=1))

    @property
    def live(self) -> int:
        """Pixels that have a ray."""
        return int(self.has_ray.sum())

    @property
    def ends(self) -> np.ndarray:
        """(n,) float32, where each ray ends: inf where nothing ends it."""
        if self.t_max is None:
            return np.full(len(self.origins), np.inf, np.float32)
        return self.t_max

    def compact(self, most: int | None = None) -> Workload:
        """The pixels alone that have a ray, in their order; ``most`` of them, evenly spread."""
        live = np.flatnonzero(self.has_ray)
        if most is not None and len(live) > most:
            live = live[np.linspace(0, len(live) - 1, most).astype(np.int64)]
        return Workload(*(np.ascontiguousarray(a[live], np.float32)
                          for a in (self.origins, self.directions)), self.size,
                        None if self.t_max is None else self.t_max[live], self.any_hit)

    def part(self, pixels: np.ndarray) -> Workload:
        """The rays of (h, w) pixels, row by row; they are no square image then."""
        chosen = pixels.reshape(-1)
        return Workload(self.origins[chosen], self.directions[chosen], self.size,
                        None if self.t_max is None else self.t_max[chosen], self.any_hit,
                        pixels.shape)

    def trace(self, tracer: Tracer) -> Hits | None:
        """The hits; None where any hit answers, as that is all that is asked."""
        shape = self.shape or (self.size, self.size)
        t_max = np.inf if self.t_max is None else self.t_max
        if self.any_hit:
            tracer.occluded(self.origins, self.directions, t_max, shape=shape, invalid="miss")
            return None
        return tracer.trace(self.origins, self.directions, t_max=t_max, shape=shape,
                            invalid="miss")


def mirror(bounces: int) -> str:
    """The name of the workload of rays that mirrors have thrown back so often."""
    return bounced(MIRROR, bounces)


def diffuse(bounces: int) -> str:
    """The name of the workload of rays that diffuse surfaces have scattered so often."""
    return bounced(DIFFUSE, bounces)


def bounced(kind: str, bounces: int) -> str:
    """The name of the workload of rays after so many bounces of a kind; eye rays after none."""
    return f"{kind} {bounces}" if bounces else EYE


def told(name: str) -> str:
    """A workload's name as a sentence has it: the first bounce goes without its number."""
    return name.removesuffix(" 1")


@functools.lru_cache(maxsize=8)
def workload(scene: str, name: str, size: int) -> Workload:
    """The workload of a name: ``eye rays``, ``shadow rays``, or ``mirror rays 2`` of a scene all
    mirrors after two bounces, ``diffuse rays 2`` of one without any, and ``random rays`` from
    anywhere in its box to anywhere."""
    if name == EYE:
        origins, directions = load(scene).camera.rays((size, size))
        return Workload(origins.reshape(-1, 3), directions.reshape(-1, 3), size)
    if name == RANDOM:
        return Workload(*random_rays(load(scene), size * size, SEED), size)
    if name == SHADOW:
        return _shadows(load(scene), workload(scene, EYE, size), _hits(scene, EYE, size))
    for kind, bounce in ((MIRROR, _mirrored), (DIFFUSE, _scattered)):
        if name.startswith(kind):
            before = bounced(kind, int(name.removeprefix(kind)) - 1)
            return bounce(load(scene), workload(scene, before, size), _hits(scene, before, size))
    raise ValueError(f"no workload {name!r}")


def _shadows(scene: Scene, seen: Workload, hits: Hits) -> Workload:
    """A ray from each hit that faces the light; a surface that faces away is dark without one."""
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
    """A ray from each hit in a direction of its own, as often as its cosine to the normal says."""
    normals = _surfaces(scene, seen, hits)[1]
    directions = np.random.default_rng(SEED).normal(size=normals.shape)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions = (0.999 * directions + normals).astype(np.float32)
    return Workload(spawn(scene, hits, directions), directions, seen.size)


def _surfaces(scene: Scene, seen: Workload, hits: Hits) -> tuple[np.ndarray, np.ndarray]:
    """Hit points and the unit normals there that face where the ray came from, (n, 3) each; NaN
    where nothing was hit."""
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
    """Every method has the same hits; this one shares its tree with those that are measured."""
    with Tracer(load(scene), "kd-short-stack") as tracer:
        found = workload(scene, name, size).trace(tracer)
    assert found is not None
    return found


@functools.lru_cache(maxsize=2)
def load(name: str) -> Scene:
    """A scene by name; the last ones are kept."""
    return load_scene(name)
