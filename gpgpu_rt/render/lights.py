"""Lights of a picture: computes the uniforms for the shading pass of each light."""
from __future__ import annotations

import numpy as np

from ..scene.scene import Scene
from .needs import SceneNeeds

# Steps of a low-discrepancy sequence in the unit square: inverse powers of the plastic number, the
# root of x^3 = x + 1 (Roberts 2018).
_PLASTIC = 1.32471795724474602596
_STEP = np.array((1 / _PLASTIC, 1 / _PLASTIC ** 2))

Uniforms = dict[str, object]


def light_uniforms(scene: Scene, needs: SceneNeeds, depth: int = 0, sample: int = 0
                   ) -> list[Uniforms]:
    """Return the uniforms of ``render/light.glsl`` for each shadow ray of a hit. If the programs
    expect a light and the scene has none, return a black point light.

    ``depth`` is the number of bounces so far. Each bounce multiplies the number of rays and
    reduces their weight. Each bounce therefore halves the number of shadow rays towards emitting
    triangles. Each ``sample`` of a pixel uses other points on these triangles.
    """
    lights: list[Uniforms] = [
        {"light_position": light.position, "light_intensity": light.intensity,
         "light_is_area": False} for light in scene.lights if any(light.intensity)]
    if len(scene.emitters):
        lights += _places(scene, max(needs.asked.light_samples >> depth, 1), sample)
    if not lights and needs.want(("SHADOWS",)):
        above = np.add(scene.bounds[1], 1 + scene.extent)
        lights = [{"light_position": tuple(above.tolist()), "light_intensity": (0.0, 0.0, 0.0),
                   "light_is_area": False}]
    return lights


def _places(scene: Scene, count: int, sample: int) -> list[Uniforms]:
    """Return the uniforms of ``count`` points on emitting triangles, distributed in proportion to
    the triangles' power.

    If there are at least as many points as triangles, each triangle has at least one point, and
    its power is divided among its points. Otherwise, each point emits an equal share of the total
    power. The point replaces its own triangle and neighbouring emitters without a point.
    """
    rows = scene.emitters
    corners = scene.triangles[rows].astype(np.float64)
    edges = corners[:, 1:] - corners[:, :1]
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
    radiance = np.array([scene.materials[m].emission for m in scene.material_of[rows]])
    power = area * radiance.max(axis=1)
    if len(rows) <= count:
        wanted = power / power.sum() * count
        chosen = np.maximum(np.floor(wanted), 1).astype(int)
        # Add or remove one point at a time until the sum is right.
        while chosen.sum() != count:
            step = 1 if chosen.sum() < count else -1
            gap = np.where((step < 0) & (chosen == 1), -np.inf, step * (wanted - chosen))
            chosen[np.argmax(gap)] += step
        light = np.repeat(np.arange(len(rows)), chosen)
        share = 1 / chosen[light]
    else:
        edge = np.cumsum(power) / power.sum()
        light = np.searchsorted(edge, (np.arange(count) + 0.5) / count)
        share = power.sum() / (count * power[light])
    intensity = radiance[light] * (area[light] * share / np.pi)[:, None]
    square = (0.5 + (sample * count + np.arange(count))[:, None] * _STEP) % 1
    return [{"light_position": tuple(corners[k, 0].tolist()),
             "light_edge_u": tuple(edges[k, 0].tolist()),
             "light_edge_v": tuple(edges[k, 1].tolist()),
             "light_intensity": tuple(intensity[j].tolist()),
             "light_place": tuple(square[j].tolist()), "light_is_area": True}
            for j, k in enumerate(light)]
