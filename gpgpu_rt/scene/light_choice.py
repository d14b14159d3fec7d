"""Light choice: chooses the light of a shadow ray from two random numbers, with a table."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .light import PointLight
from .luminance import luminance
from .scene import Scene


def asks_surroundings(scene: Scene) -> bool:
    """Return whether next-event estimation samples the surroundings of a scene.

    An image is always sampled, because it may be bright in a few small places. A sky is smooth, so
    bounced rays find its light as well as shadow rays do. Sampling the sky would leave fewer
    shadow rays for other lights, so a sky is sampled only if the scene has no other light.
    """
    if scene.environment is None or not scene.environment.emits:
        return False
    return scene.environment.kind == "image" or not (
        len(scene.emitters) or any(any(light.intensity) for light in scene.lights))


@dataclass(frozen=True)
class LightChoice:
    """An alias table that chooses a point light, an emitting triangle or the surroundings, each in
    proportion to its estimated contribution.

    Each entry names a light and an ``alias``, which is another light. The first random number
    picks an entry. With probability ``keep`` the choice is the entry's light, otherwise its alias
    (Walker 1977, built by Vose's method of 1991). A choice needs one lookup, however many lights.

    Attributes
    ----------
    triangle : The light of each entry, (n,) int32: the row of a triangle in the scene, or -1 - k
        for point light k. The surroundings have k = p, the number of point lights.
    alias : Another light for each entry, encoded as in ``triangle``, (n,) int32.
    keep : Probability to choose ``triangle`` and not ``alias``, (n,) float32 in [0, 1].
    point_probability : Probability of each point light, (p,) float64.
    density : Probability per square world unit to choose a point on an emitting triangle, divided
        by the luminance of the triangle's emission. This quotient is equal for all triangles.
    far : Probability of the surroundings.
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
        """Return the light choice of a scene.

        A triangle weighs its area times the luminance of its emission. A point light, whose light
        does not decrease with distance, weighs as much as a triangle that gives the same light at
        a distance of half the scene's extent. The surroundings weigh as much as a point light of
        their power, but at most as much as all other lights together, because objects may hide the
        surroundings.
        """
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
        """Return the table for shaders."""
        return {"light": self.triangle, "alias": self.alias, "keep": self.keep}

    def points(self, lights: Sequence[PointLight]) -> dict[str, np.ndarray]:
        """Return the point lights for shaders."""
        intensity = np.array([light.intensity for light in lights]).reshape(-1, 3)
        chance = np.where(self.point_probability > 0, self.point_probability, 1)
        return {"position": np.array([light.position for light in lights]).reshape(-1, 3),
                # A white surface reflects ``intensity`` if its irradiance is pi * ``intensity``.
                "strength": np.pi * intensity / chance[:, None]}

    def far_uniforms(self, scene: Scene) -> dict[str, object]:
        """Return the uniforms with which shaders sample the surroundings."""
        light = scene.environment.image_light if scene.environment is not None else None
        return {"far_light": -1 - len(scene.lights), "far_chance": self.far,
                "image_density": self.far / light.power if light is not None else 0.0}

    def choose(self, random: np.ndarray, coin: np.ndarray) -> np.ndarray:
        """Return (n,) chosen lights, named as in ``triangle``, for (n,) random numbers in (0, 1):
        ``random`` picks an entry, and ``coin`` picks the entry's light or its alias."""
        entry = np.minimum((random * len(self)).astype(np.int64), len(self) - 1)
        return np.where(coin < self.keep[entry], self.triangle[entry], self.alias[entry])


def _alias(probabilities: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the probability to keep each entry, and the alias of each entry.

    Givers are the entries above the mean. One after another, givers fill the deficits of the
    entries below the mean. The last deficit that a giver fills usually exceeds the rest of the
    giver's surplus. The giver then has a deficit itself, which the next giver fills. A search in
    the cumulative sums of deficits and surpluses replaces Vose's loop.
    """
    count = len(probabilities)
    scaled = probabilities * count
    order = np.argsort(scaled >= 1, kind="stable")      # entries below the mean first
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
    # The next giver fills the deficit of a giver that gave more than its surplus.
    last = np.searchsorted(needed - lacking, given, side="left") - 1
    overdrawn = np.maximum(needed[np.maximum(last, 0)] - given, 0) * (last >= 0)
    keep[large] = 1 - overdrawn
    other[large] = large[np.minimum(np.arange(len(large)) + 1, len(large) - 1)]
    return np.clip(keep, 0, 1), other
