"""Lit: scenes with mirrors, glass and lamps, mostly for Hachisuka's survey, Figures 1 and 7."""
from __future__ import annotations

import numpy as np

from ..attributes import smooth_normals
from ..camera import Camera
from ..light import Environment, PointLight
from ..material import Material
from ..texture import Texture
from . import cornell, creatures
from .built import Built
from .shapes import ball, boxes, divide, floor, quad, revolve, smooth

SKY = Environment.sky((0.35, 0.5, 0.8), (0.75, 0.72, 0.68))
SILVER = Material("silver", mirror=(0.86, 0.84, 0.8))
GLASS = Material("glass", ior=1.5)
LAMP = Material("lamp", emission=(14, 13, 11))
PAPER = Material("paper", (0.72, 0.72, 0.7))


def _tiles() -> Material:
    rng = np.random.default_rng(5)
    checks = np.indices((8, 8)).sum(axis=0) % 2
    shades = np.where(checks[..., None], (0.62, 0.58, 0.5), (0.16, 0.2, 0.24))
    texels = np.kron(shades * rng.uniform(0.85, 1.1, (8, 8, 1)), np.ones((8, 8, 1)))
    return Material("tiles", (1, 1, 1), texture=Texture("tiles", texels))


def _built(parts: list[tuple[np.ndarray, Material, bool]], camera: Camera, *,
           uv: np.ndarray | None = None, **said: object) -> Built:
    """Return a scene of (triangles, material, smooth) parts. ``uv`` has the first part's texture
    coordinates, and ``said`` has further arguments of Scene."""
    triangles = np.concatenate([part for part, _, _ in parts])
    materials = tuple({material.name: material for _, material, _ in parts}.values())
    row = np.concatenate([np.full(len(part), materials.index(material))
                          for part, material, _ in parts])
    normals = np.concatenate([smooth_normals(np.float32(part)) if rounded else 0 * part
                              for part, _, rounded in parts])
    if uv is not None:
        uv = np.concatenate([uv, np.zeros((len(triangles) - len(uv), 3, 2))])
    colours = np.array([material.diffuse for material in materials])[row]
    return Built(triangles, colours, camera, (0, 0, 0), appearance={
        "lights": (), "materials": materials, "material_of": row, "uv": uv,
        "normals": normals if normals.any() else None, "environment": None, **said})


def _floor_uv(triangles: np.ndarray, size: float) -> np.ndarray:
    """Return coordinates of a texture seen from above; it repeats every ``size`` world units."""
    return triangles[:, :, [0, 2]] / size


def cornell_light() -> Built:
    """Return the Cornell box with its lamp as the light: 38 triangles.

    The lamp's radiance is a coarse RGB form of Cornell's spectrum: 18.4, 15.6 and 8. The lamp lies
    in a hole of the ceiling, as in Cornell's box. If the lamp hung below the ceiling, the lamp's
    back would light the gap above very brightly. Paths would find this gap so rarely that the gap
    would cause most noise.
    """
    box, ceiling = cornell.make(), 2
    triangles, colours = np.asarray(box.triangles, np.float64), np.asarray(box.colours)
    outer = triangles[[ceiling, ceiling, ceiling, ceiling + 1], [0, 1, 2, 2]]
    inner = triangles[[-2, -2, -2, -1], [0, 1, 2, 2]]
    inner[:, 1] = outer[0, 1]
    # Pair each of the hole's corners with the nearest corner of the ceiling.
    inner = inner[np.linalg.norm(outer[:, None] - inner, axis=2).argmin(axis=1)]
    behind = np.roll([outer, inner], -1, axis=1)
    ring = [quad(a, b, d, c) for a, b, c, d in zip(outer, behind[0], inner, behind[1])]
    triangles = np.concatenate([triangles[:ceiling], *ring, triangles[ceiling + 2:-2],
                                quad(*inner)])
    colours = np.concatenate([colours[:ceiling], np.repeat(colours[[ceiling]], 8, axis=0),
                              colours[ceiling + 2:]])
    lamp = Material("lamp", (0.78, 0.78, 0.78), emission=(18.4, 15.6, 8.0))
    row = np.zeros(len(triangles), np.int32)
    row[-2:] = 1
    return Built(triangles, colours, box.camera, (0, 0, 0), appearance={
        "lights": (), "materials": (Material("wall"), lamp), "material_of": row,
        "environment": None})


def statue() -> Built:
    """Return a standing figure of silver on a tiled floor under the sky: 100,002 triangles."""
    figure = np.asarray(creatures.buddha().triangles)
    ground = floor((-12, -12), (12, 12), -0.3)
    camera = Camera((1.6, 2.0, 4.6), (0.0, 0.85, 0.0), fov=38)
    sun = PointLight((6.0, 14.0, 9.0), (0.75, 0.72, 0.66))
    return _built([(ground, _tiles(), False), (figure, SILVER, True)], camera,
                  uv=_floor_uv(ground, 4.0), environment=SKY, lights=(sun,))


def glass_teapot() -> Built:
    """Return a teapot of solid glass on a tiled floor, under a lamp and the sky: 12,002
    triangles."""
    # Seen from outside, the corners of `pot` run clockwise; glass needs anticlockwise corners.
    pot, _ = divide(creatures.pot(11_000)[:, ::-1], 11_998)
    ground = floor((-14, -14), (14, 14), -0.01)
    lamp = quad((-2, 9, -2), (2, 9, -2), (2, 9, 2), (-2, 9, 2))
    camera = Camera((0.4, 4.6, 9.0), (0.2, 1.3, 0.0), fov=44)
    return _built([(ground, _tiles(), False), (lamp, LAMP, False), (pot, GLASS, True)], camera,
                  uv=_floor_uv(ground, 6.0), environment=SKY)


def soft_shadows() -> Built:
    """Return a vase, a ball and a block under a square lamp: 6,000 triangles."""
    ground = floor((-8, -8), (8, 8), 0.0, 4)
    vase = revolve(smooth([(0.02, 0.0), (0.6, 0.0), (0.85, 0.8), (0.4, 1.7), (0.55, 2.2)], 30), 60)
    vase = vase + (-1.6, 0.0, 0.0)
    sphere = ball(1_800, (0.4, 0.75, 0.9), (0.75,) * 3)
    block = boxes((1.3, 0.0, -1.2), (2.5, 1.9, 0.0))
    lamp = quad((-1.4, 6, -1.4), (1.4, 6, -1.4), (1.4, 6, 1.4), (-1.4, 6, 1.4))
    rest = 6_000 - sum(len(part) for part in (ground, sphere, block, lamp))
    vase, _ = divide(vase, rest)
    camera = Camera((0.3, 3.6, 8.0), (0.1, 0.85, 0.0), fov=38)
    clay = Material("clay", (0.62, 0.36, 0.24))
    return _built([(ground, PAPER, False), (lamp, LAMP, False), (vase, clay, True),
                   (sphere, Material("ivory", (0.7, 0.66, 0.55), glossy=(0.2,) * 3,
                                     roughness=0.15), True),
                   (block, Material("slate", (0.25, 0.3, 0.36)), False)], camera,
                  environment=Environment.constant((0.12, 0.13, 0.15)))
