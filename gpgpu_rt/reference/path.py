"""The float64 path tracer: computes in numpy what ``glsl/render/path*.frag`` compute on the GPU.

The algorithm is path tracing (Kajiya, "The Rendering Equation", SIGGRAPH 1986). At each vertex, a
path samples one light (next-event estimation), then continues in a direction sampled from the
material. Both techniques may find the same light. The power heuristic (for a sky, the balance
heuristic) therefore weights the light from each technique (Veach and Guibas, "Optimally Combining
Sampling Techniques for Monte Carlo Rendering", SIGGRAPH 1995). The shaders use the same random
numbers and lights, so pictures differ only by float32 rounding.

In physics, radiance changes where light enters or leaves a denser medium. The reference and the
shaders omit this change, which matters only for a light or an eye inside glass.
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..hits import Hits
from ..scene.camera import Camera
from ..scene.light_choice import LightChoice
from ..scene.luminance import luminance
from ..scene.scene import Scene
from .nearest import trace
from .path_settings import MOST_SURVIVE, PathSettings
from .random_numbers import random_numbers
from .sampling import (
    cosine_density, frames_around, fresnel, lobe_density, refracted, sample_cosine, sample_lobe,
    sample_triangle
)
from .sobol import sobol_numbers
from .spawn import spawn

BRUTE_FORCE = 8     # up to this number of triangles, brute force is faster than a tree
AT_ONCE = 1 << 16   # paths traced together, but at least one for each pixel
TINY = 1e-30        # guards divisions by a density that may be 0


@dataclass
class PathPicture:
    """A picture of linear radiance, (height, width, 3) float64 each: ``mean`` of each pixel's
    samples, and ``error``, the standard error of this mean, estimated from the samples'
    variance."""

    mean: np.ndarray
    error: np.ndarray


def path_picture(scene: Scene, size: tuple[int, int], samples: int,
                 settings: PathSettings = PathSettings(), camera: Camera | None = None,
                 first_sample: int = 0) -> PathPicture:
    """Return the path traced picture of a scene.

    Parameters
    ----------
    scene : Scene
    size : (width, height) pixels
    samples : paths per pixel
    settings : the path settings
    camera : by default the scene's own camera
    first_sample : number of each pixel's first sample; a sample's number determines its random
        numbers
    """
    width, height = size
    pixels = width * height
    total, squares = np.zeros((pixels, 3)), np.zeros((pixels, 3))
    at_once = max(1, AT_ONCE // pixels)
    for first in range(0, samples, at_once):
        some = np.arange(first, min(first + at_once, samples))
        pixel = np.tile(np.arange(pixels), len(some))
        light = path_radiance(scene, size, pixel % width, pixel // width,
                              np.repeat(some + first_sample, pixels), settings, camera)
        light = light.reshape(len(some), pixels, 3)
        total += light.sum(axis=0)
        squares += (light ** 2).sum(axis=0)
    mean = total / samples
    variance = np.maximum(squares / samples - mean ** 2, 0) / max(samples - 1, 1)
    return PathPicture(mean.reshape(height, width, 3),
                       np.sqrt(variance).reshape(height, width, 3))


def path_radiance(scene: Scene, size: tuple[int, int], x: np.ndarray, y: np.ndarray,
                  sample: np.ndarray, settings: PathSettings = PathSettings(),
                  camera: Camera | None = None) -> np.ndarray:
    """Return the radiance of n paths, (n, 3). Path i is the path number ``sample[i]`` of the pixel
    (``x[i]``, ``y[i]``), with row 0 at the top."""
    return _Paths(scene, size, x, y, sample, settings, camera or scene.camera).run()


class _Paths:
    """The state of n paths: their rays, weights and collected light."""

    def __init__(self, scene: Scene, size: tuple[int, int], x: np.ndarray, y: np.ndarray,
                 sample: np.ndarray, settings: PathSettings, camera: Camera) -> None:
        self.scene, self.settings = scene, settings
        self.lights = LightChoice.of(scene)
        self.emission = np.array([m.emission for m in scene.materials])
        self.counter = x, y, sample
        at = np.stack([x, y], axis=1) + self._random(np.arange(len(x)), 0, 0)[:, 2:]
        at = 2 * at / size - 1
        right, up, forward = camera.basis(size)
        direction = _unit(forward + at[:, :1] * right - at[:, 1:] * up)
        self.origin = np.broadcast_to(np.float32(camera.eye), direction.shape).copy()
        self.direction = direction
        self.weight = np.ones((len(x), 3))
        # The probability density of the ray's direction; infinite for eye rays, mirrors and
        # glass, where the possible directions are discrete.
        self.density = np.full(len(x), np.inf)
        self.light = np.zeros((len(x), 3))
        self.alive = np.arange(len(x))

    def run(self) -> np.ndarray:
        for vertex in range(1, self.settings.bounces + 2):
            if not len(self.alive):
                break
            hits = _trace(self.scene, self.origin[self.alive], self.direction[self.alive])
            self._missed(hits)
            hits, self.alive = _some(hits, hits.hit), self.alive[hits.hit]
            at = _Surfaces(self.scene, hits, self.direction[self.alive])
            self._emitted(at, hits)
            if vertex == self.settings.bounces + 1:
                break
            if len(self.lights):
                self._lit(at, hits, vertex)
            self._go_on(at, hits, vertex)
        return self.light

    def _random(self, paths: np.ndarray, vertex: int, block: int) -> np.ndarray:
        x, y, sample = (a[paths] for a in self.counter)
        numbers = sobol_numbers if self.settings.sampler == "sobol" else random_numbers
        return numbers(x, y, sample, vertex, block, self.settings.seed)

    def _missed(self, hits: Hits) -> None:
        away = self.alive[~hits.hit]
        if self.scene.environment is None:
            return
        radiance = self.scene.environment.radiance(self.direction[away])
        found = self.density[away]
        certain = np.isinf(found)
        found = np.where(certain, 1, found)
        asked = np.where(certain, 0, self._far_density(self.direction[away], radiance, found))
        share = np.where(asked > 0, found * self._far_weight(found, asked), 1)
        self.light[away] += self.weight[away] * radiance * share[:, None]

    def _far_density(self, direction: np.ndarray, radiance: np.ndarray, found: np.ndarray
                     ) -> np.ndarray:
        """Return the density with which next-event estimation samples the surroundings in each
        ``direction``, including the probability of choosing the surroundings. An image is sampled
        in proportion to the luminance of its ``radiance``. A sky is sampled by the material's own
        technique, with the density ``found``."""
        light = self.scene.environment.image_light if self.scene.environment else None
        return self.lights.far * (found if light is None else light.density(direction, radiance))

    def _far_weight(self, mine: np.ndarray, other: np.ndarray) -> np.ndarray:
        """Return the weight of light from the surroundings, divided by ``mine``, the density of
        the technique that found the light. ``other`` is the other technique's density. For a sky,
        the densities are proportional, so the weights of both heuristics are constant. The balance
        heuristic is simpler."""
        if self.scene.environment is not None and self.scene.environment.image_light is not None:
            return _power_weight(mine, other)
        return 1 / np.maximum(mine + other, TINY)

    def _emitted(self, at: _Surfaces, hits: Hits) -> None:
        """Add the light of emitting triangles that paths hit; both sides of a triangle emit."""
        emission = self.emission[at.material]
        some = np.flatnonzero(emission.any(axis=1))
        paths, emission = self.alive[some], emission[some]
        asked = (self.lights.density * luminance(emission) * hits.t[some] ** 2
                 / np.abs(_dot(at.flat[some], self.direction[paths])))
        found = self.density[paths]
        certain = np.isinf(found)
        found = np.where(certain, 1, found)
        share = np.where(certain, 1, found * _power_weight(found, asked))
        self.light[paths] += self.weight[paths] * emission * share[:, None]

    def _lit(self, at: _Surfaces, hits: Hits, vertex: int) -> None:
        """Sample one light at each vertex, and add its contribution unless it is occluded."""
        rows = np.flatnonzero(at.scatters)
        random = self._random(self.alive[rows], vertex, 1)
        light = self.lights.choose(random[:, 0], random[:, 1])
        far = light == -1 - len(self.scene.lights)
        self._lit_from_afar(at, hits, rows[far], random[far])
        rows, random, light = rows[~far], random[~far], light[~far]
        is_point = light < 0
        place, emission, normal = (np.zeros((len(rows), 3)) for _ in range(3))
        if is_point.any():
            points = self.lights.points(self.scene.lights)
            which = -1 - light[is_point]
            place[is_point] = points["position"][which]
            emission[is_point] = points["strength"][which]
        area = ~is_point
        corners = self.scene.triangles[light[area]].astype(np.float64)
        edges = corners[:, 1:] - corners[:, :1]
        uv = sample_triangle(random[area, 2:])
        place[area] = corners[:, 0] + (uv[:, :, None] * edges).sum(axis=1)
        normal[area] = _unit(np.cross(edges[:, 0], edges[:, 1]))
        to_light = place - at.point[rows]
        distance = np.linalg.norm(to_light, axis=1)
        direction = to_light / distance[:, None]
        reflected, found = at.scattered(rows, direction)
        if area.any():
            shone = self.emission[self.scene.material_of[light[area]]]
            facing = np.abs(_dot(normal[area], direction[area]))
            bright = self.lights.density * luminance(shone)
            # The light sample's density per steradian at the vertex is p = bright d^2 / facing.
            # _power_weight(p, found) equals facing * _power_weight(facing p, facing found).
            emission[area] = shone * (facing * _power_weight(
                bright * distance[area] ** 2, facing * found[area]))[:, None]
        useful = np.flatnonzero((reflected > 0).any(axis=1) & (emission > 0).any(axis=1))
        rows, light, direction = rows[useful], light[useful], direction[useful]
        distance = distance[useful]
        start = spawn(self.scene, _some(hits, rows), direction)
        between = _trace(self.scene, start, direction * distance[:, None])
        # A hit beyond 1 - 1e-5 of the distance is the light itself, within rounding.
        free = (between.t >= 1 - 1e-5) | (between.triangle == light)
        paths = self.alive[rows]
        self.light[paths] += (free[:, None] * self.weight[paths]
                              * reflected[useful] * emission[useful])

    def _lit_from_afar(self, at: _Surfaces, hits: Hits, rows: np.ndarray, random: np.ndarray
                       ) -> None:
        """Add the light of the surroundings at the vertices ``rows``, which chose the surroundings
        as their light; see `_far_density`."""
        if not len(rows):
            return
        environment = self.scene.environment
        assert environment is not None
        if environment.image_light is not None:
            direction, radiance = environment.image_light.draw(random[:, 2:])
        else:
            numbers = np.full((len(at.material), 4), 0.25)
            numbers[rows] = random
            direction, _, density = (found[rows] for found in at.next(numbers))
            some = ~np.isinf(density)
            rows, direction = rows[some], direction[some]
            radiance = environment.radiance(direction)
        reflected, found = at.scattered(rows, direction)
        asked = self._far_density(direction, radiance, found)
        arrives = reflected * radiance * self._far_weight(asked, found)[:, None]
        useful = np.flatnonzero((arrives > 0).any(axis=1))
        rows, direction = rows[useful], direction[useful]
        free = ~_trace(self.scene, spawn(self.scene, _some(hits, rows), direction), direction).hit
        paths = self.alive[rows]
        self.light[paths] += free[:, None] * self.weight[paths] * arrives[useful]

    def _go_on(self, at: _Surfaces, hits: Hits, vertex: int) -> None:
        """Choose the next ray of each path, and remove from ``alive`` the paths that end."""
        random = self._random(self.alive, vertex, 0)
        direction, weight, density = at.next(random)
        weight *= self.weight[self.alive]
        most = weight.max(axis=1)
        chance = np.where(vertex >= self.settings.roulette, np.minimum(most, MOST_SURVIVE), 1)
        on = np.flatnonzero((most > 0) & (random[:, 1] < chance))
        self.alive, direction = self.alive[on], direction[on]
        self.weight[self.alive] = weight[on] / chance[on, None]
        self.density[self.alive] = density[on]
        self.direction[self.alive] = direction
        self.origin[self.alive] = spawn(self.scene, _some(hits, on), direction)


class _Surfaces:
    """The surfaces at n hits: normals on the incoming side, and material properties.

    Parameters
    ----------
    scene : Scene
    hits : the hits, without misses
    direction : (n, 3), directions of the incoming rays
    """

    def __init__(self, scene: Scene, hits: Hits, direction: np.ndarray) -> None:
        rows = hits.triangle
        self.direction = direction
        self.material = scene.material_of[rows]         # type: ignore[index]
        weights = np.stack([1 - hits.u - hits.v, hits.u, hits.v], axis=1)
        corners = scene.triangles[rows].astype(np.float64)
        self.point = _blend(weights, corners)
        flat = _unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
        self.outside = _dot(flat, direction) <= 0
        self.flat = np.where(self.outside[:, None], flat, -flat)
        self.normal = self.flat
        if scene.normals is not None:
            blended = _blend(weights, scene.normals[rows].astype(np.float64))
            blended = np.where((_dot(blended, self.flat) < 0)[:, None], -blended, blended)
            usable = (_dot(blended, blended) > 1e-6) & (_dot(blended, direction) < 0)
            self.normal = np.where(usable[:, None], _unit(blended), self.flat)
        materials = scene.materials
        self.diffuse = scene.colours[rows].astype(np.float64)
        for k, material in enumerate(materials):
            if material.texture is not None and scene.uv is not None:
                some = self.material == k
                uv = _blend(weights[some], scene.uv[rows[some]].astype(np.float64))
                self.diffuse[some] *= material.texture.sample(uv)
        self.mirror = np.array([m.mirror for m in materials])[self.material]
        self.glossy = np.array([m.glossy for m in materials])[self.material]
        self.exponent = np.array([m.exponent for m in materials])[self.material]
        self.ior = np.array([m.ior or 0.0 for m in materials])[self.material]
        shares = np.stack([self.diffuse, self.glossy, self.mirror]).sum(axis=2)
        total = shares.sum(axis=0)
        # (3, n): the probabilities of diffuse, glossy and mirror reflection.
        self.chance = shares / np.where(total > 0, total, 1)
        self.scatters = (self.ior == 0) & ((self.diffuse > 0) | (self.glossy > 0)).any(axis=1)

    def scattered(self, rows: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Evaluate the material at k hits for light from unit directions, (k, 3). Return the
        reflectance towards the incoming ray times the cosine, (k, 3), and the density with which
        `next` samples the directions, (k,)."""
        normal = self.normal[rows]
        cosine = _dot(normal, direction) * (_dot(self.flat[rows], direction) > 0)
        cosine = np.maximum(cosine, 0)
        mirrored = _reflect(self.direction[rows], normal)
        exponent = self.exponent[rows]
        lobe = lobe_density(_dot(mirrored, direction), exponent)
        reflected = (self.diffuse[rows] / np.pi + self.glossy[rows]
                     * (lobe * (exponent + 2) / (exponent + 1))[:, None]) * cosine[:, None]
        return reflected, (self.chance[0, rows] * cosine_density(cosine)
                           + self.chance[1, rows] * lobe)

    def next(self, random: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Sample directions from which light may arrive, with (n, 4) random numbers. Return the
        directions (n, 3); their weights (n, 3), 0 where the path ends; and their densities (n,).
        Russian roulette uses the second random number."""
        n = len(random)
        direction, weight = np.zeros((n, 3)), np.zeros((n, 3))
        density = np.full(n, np.inf)
        glass, pick = self.ior > 0, random[:, 0]
        diffuse = ~glass & (pick < self.chance[0])
        glossy = ~glass & ~diffuse & (pick < self.chance[0] + self.chance[1])
        mirror = ~glass & ~diffuse & ~glossy & (self.chance[2] > 0)
        mirrored = _reflect(self.direction, self.normal)
        for some, axis, local in ((diffuse, self.normal, sample_cosine(random[:, 2:])),
                                  (glossy, mirrored, sample_lobe(random[:, 2:], self.exponent))):
            frames = frames_around(axis[some])
            direction[some] = (local[some, :, None] * frames).sum(axis=1)
        rows = np.flatnonzero(diffuse | glossy)
        reflected, density[rows] = self.scattered(rows, direction[rows])
        weight[rows] = reflected / np.maximum(density[rows], TINY)[:, None]
        direction[mirror] = self._off(mirrored[mirror], self.flat[mirror])
        weight[mirror] = self.mirror[mirror] / self.chance[2, mirror, None]
        if glass.any():
            ior = np.where(self.outside, self.ior, 1 / np.where(glass, self.ior, 1))[glass]
            d, normal, flat = self.direction[glass], self.normal[glass], self.flat[glass]
            back = pick[glass] < fresnel(np.minimum(-_dot(d, normal), 1), ior)
            through = self._off(refracted(d, normal, ior), -flat)
            direction[glass] = np.where(back[:, None], self._off(mirrored[glass], flat), through)
            weight[glass] = 1
        return direction, weight, density

    @staticmethod
    def _off(direction: np.ndarray, side: np.ndarray) -> np.ndarray:
        """Return the directions, mirrored where an interpolated normal made them point to the
        wrong side of the flat triangle. The normal ``side`` points to the correct side."""
        away = _dot(direction, side) <= 0
        return np.where(away[:, None], _reflect(direction, side), direction)


def _trace(scene: Scene, origins: np.ndarray, directions: np.ndarray) -> Hits:
    return trace(scene, origins, directions, np.float32(1.2e-38),
                 accelerated=len(scene) > BRUTE_FORCE)


def _power_weight(mine: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the power heuristic's weight of a sampling technique, divided by its density
    ``mine``, or 0 where ``mine`` is 0. ``other`` is the other technique's density."""
    most = np.maximum(np.maximum(mine, other), TINY)
    mine, other = mine / most, other / most
    return mine / (np.maximum(mine ** 2 + other ** 2, TINY) * most)


def _some(hits: Hits, rows: np.ndarray) -> Hits:
    return Hits(*(getattr(hits, name)[rows] for name in ("t", "u", "v", "triangle", "status")))


def _blend(weights: np.ndarray, corners: np.ndarray) -> np.ndarray:
    return np.einsum("nc,ncx->nx", weights, corners)


def _reflect(direction: np.ndarray, normal: np.ndarray) -> np.ndarray:
    return direction - 2 * _dot(normal, direction)[:, None] * normal


def _unit(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0, length, 1)


def _dot(a: np.ndarray, b: np.ndarray) -> Any:
    return np.einsum("nx,nx->n", a, b)
