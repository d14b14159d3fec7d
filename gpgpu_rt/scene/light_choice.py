"""Which light a path asks at a vertex: the table that two random numbers choose it from."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .light import PointLight
from .luminance import luminance
from .scene import Scene


def asks_surroundings(scene: Scene) -> bool:
    """Whether paths ask what surrounds a scene: an image, which may be bright in few places. Skies
    are even, and found by paths as well as by asking: that is worth a shadow ray, but not one less
    for another light."""
    if scene.environment is None or not scene.environment.emits:
        return False
    return scene.environment.kind == "image" or not (
        len(scene.emitters) or any(any(light.intensity) for light in scene.lights))


@dataclass(frozen=True)
class LightChoice:
    """Point lights, triangles that emit and surroundings, each chosen as often as it is likely to
    matter.

    An entry stands for a light, and is kept with probability ``keep``; else its ``alias`` is taken
    (Walker 1977, by Vose's method of 1991): a choice costs one lookup however many lights there
    are.

    Attributes
    ----------
    triangle : (n,) int32, row in the scene, or -1 - k for the k-th point light; the surroundings
        count as one after the last
    alias : (n,) int32, another triangle or light, named the same way
    keep : (n,) float32 in [0, 1]
    point_probability : (p,) float64, how often each point light is chosen
    density : of a triangle, by area and by luminance of its emission: how likely a place on it is
        per square world unit, divided by that luminance
    far : how often the surroundings are chosen
    """

    triangle: np.ndarray
    alias: np.ndarray
    keep: np.ndarray
    point_probability: np.ndarray
    density: float
    far: float = 0.0

    def __len__(self) -> int:
        return len(self.triangle)

    @classmethod
    def of(cls, scene: Scene) -> LightChoice:
        """Triangles by what they send out; a point light, which has no falloff, by what a triangle
        would have to send out to light as much from a distance of half the scene's extent; an
        image by a point light that sends as much, though no more often than all others together:
        it may be hidden from where they light."""
        rows = scene.emitters
        corners = scene.triangles[rows].astype(np.float64)
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0],
                                       corners[:, 2] - corners[:, 0]), axis=1) / 2
        emission = np.array([m.emission for m in scene.materials])
        power = area * luminance(emission[scene.material_of[rows]])
        points = np.pi * luminance(np.array([p.intensity for p in scene.lights]).reshape(-1, 3))
        points *= (scene.extent / 2) ** 2
        if scene.environment is not None and asks_surroundings(scene):
            light, near = scene.environment.image_light, power.sum() + points.sum()
            far = 1.0 if light is None else light.power * (scene.extent / 2) ** 2
            points = np.append(points, min(far, near) if near > 0 else far)
        lit = np.flatnonzero(points > 0)
        weights = np.concatenate([power, points[lit]])
        total = weights.sum()
        names = np.concatenate([rows, -1 - lit]).astype(np.int32)
        if not total > 0:
            return cls(names[:0], names[:0], np.zeros(0, np.float32),
                       np.zeros(len(scene.lights)), 0.0)
        keep, other = _alias(weights / total)
        points, far = np.split(points / total, [len(scene.lights)])
        return cls(names, names[other], keep.astype(np.float32), points, 1 / total, far.sum())

    def choices(self) -> dict[str, np.ndarray]:
        """The table as programs read it."""
        return {"light": self.triangle, "alias": self.alias, "keep": self.keep}

    def points(self, lights: Sequence[PointLight]) -> dict[str, np.ndarray]:
        """Point lights as programs read them."""
        intensity = np.array([light.intensity for light in lights]).reshape(-1, 3)
        chance = np.where(self.point_probability > 0, self.point_probability, 1)
        return {"position": np.array([light.position for light in lights]).reshape(-1, 3),
                # White reflects ``intensity``, so pi times that arrives.
                "strength": np.pi * intensity / chance[:, None]}

    def far_uniforms(self, scene: Scene) -> dict[str, object]:
        """The surroundings as programs that ask them read them."""
        light = scene.environment.image_light if scene.environment is not None else None
        return {"far_light": -1 - len(scene.lights), "far_chance": self.far,
                "image_density": self.far / light.power if light is not None else 0.0}

    def choose(self, random: np.ndarray, coin: np.ndarray) -> np.ndarray:
        """(n,) rows of triangles, or -1 - k, from (n,) numbers in (0, 1) each."""
        entry = np.minimum((random * len(self)).astype(np.int64), len(self) - 1)
        return np.where(coin < self.keep[entry], self.triangle[entry], self.alias[entry])


def _alias(probabilities: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How often each entry is kept, and what is taken else.

    Entries below the mean take their rest from those above in order, each of which gives what it
    has over: where one is used up, the entry that used it up draws on the next. With both sides
    laid out along a line that is one search instead of a loop.
    """
    count = len(probabilities)
    scaled = probabilities * count
    order = np.argsort(scaled >= 1, kind="stable")      # those below first
    below = int((scaled < 1).sum())
    if below in (0, count):
        return np.ones(count), np.arange(count)
    small, large = order[:below], order[below:]
    lacking, over = 1 - scaled[small], scaled[large] - 1
    needed, given = np.cumsum(lacking), np.cumsum(over)
    keep, other = np.ones(count), np.arange(count)
    keep[small] = scaled[small]
    giver = np.minimum(np.searchsorted(given, needed - lacking, side="right"), len(large) - 1)
    other[small] = large[giver]
    # What a giver was overdrawn by, it lacks itself, and takes from the next.
    last = np.searchsorted(needed - lacking, given, side="left") - 1
    overdrawn = np.maximum(needed[np.maximum(last, 0)] - given, 0) * (last >= 0)
    keep[large] = 1 - overdrawn
    other[large] = large[np.minimum(np.arange(len(large)) + 1, len(large) - 1)]
    return np.clip(keep, 0, 1), other
