"""Lights of a picture: what each pass over the hits is to know of one light."""
from __future__ import annotations

import numpy as np

from ..scene.scene import Scene
from .needs import SceneNeeds

# Of a sequence in the unit square whose points keep apart (Roberts 2018): powers of the plastic
# number, the root of x^3 = x + 1.
_PLASTIC = 1.32471795724474602596
_STEP = np.array((1 / _PLASTIC, 1 / _PLASTIC ** 2))

Uniforms = dict[str, object]


def light_uniforms(scene: Scene, needs: SceneNeeds, depth: int = 0, sample: int = 0
                   ) -> list[Uniforms]:
    """Uniforms of ``render/light.glsl``, one entry a shadow ray; a point light that is dark where
    programs are to shade by some light and there is none.

    Rays that turned ``depth`` times are many, and each shows in few pixels or weighs little: after
    each turn they send out half as many shadow rays towards triangles that emit. Each sample of a
    pixel sends them to other places.
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
    """``count`` places on the triangles that emit, in proportion to what they send out.

    Where there are enough for all, each triangle's power is spread over the places it has, so that
    none is lost; else places stand for their neighbours along the list as well.
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
        # No more turns than triangles, though a bright one may give up several places for those
        # that are raised to one.
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
