"""Growing: makes ten scenes. Each needs more features of the renderer than the scene before.

All scenes have the same triangles: a bunny, a floor, a square above both, and two balls.
"""
from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.scene.attributes import smooth_normals
from gpgpu_rt.scene.procedural.shapes import ball, quad

STEPS = ("bare, under a sky", "+ a point light", "+ a floor of another colour",
         "+ smooth normals", "+ a texture on the floor", "+ a second light", "+ a lamp",
         "+ a glossy floor", "+ a mirror", "+ glass, an image as sky")
GREY = (0.6, 0.58, 0.54)
BUNNY, FLOOR, LAMP, BALL, GLASS = range(5)


@cache
def scenes(name: str = "bunny") -> tuple[rt.Scene, ...]:
    """Return the ten scenes, with the mesh of the scene ``name`` in the middle."""
    base = rt.load_scene(name)
    lo, hi = (side.astype(np.float64) for side in base.bounds)
    middle, size = (lo + hi) / 2, float((hi - lo).max())
    parts = [base.triangles.astype(np.float64), *(middle + size * part for part in (
        quad((-2, 0, 2), (2, 0, 2), (2, 0, -2), (-2, 0, -2)) + (0, (lo - middle)[1] / size, 0),
        quad((-0.5, 2, -0.5), (0.5, 2, -0.5), (0.5, 2, 0.5), (-0.5, 2, 0.5)),
        ball(320, (0.68, -0.25, 0.1), (0.25,) * 3),
        ball(320, (-0.5, -0.28, 0.55), (0.22,) * 3)[:, ::-1]))]
    triangles = np.concatenate(parts).astype(np.float32)
    part_of = np.repeat(np.arange(5), [len(part) for part in parts])
    normals = smooth_normals(triangles)
    normals[(part_of == FLOOR) | (part_of == LAMP)] = 0
    uv = np.zeros((len(triangles), 3, 2), np.float32)
    uv[part_of == FLOOR] = 2 * np.float32([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]])
    checks = rt.Texture("checks", np.kron([[0.2, 1], [1, 0.2]], np.ones((8, 8)))[..., None]
                        * np.ones(3))
    rows = np.linspace(1, 0.15, 32)[:, None, None] * np.array((0.55, 0.75, 1.0))
    around = rt.Texture("around", np.broadcast_to(rows, (32, 64, 3)))
    camera = rt.Camera.looking_at((lo - 0.1 * size, hi + 0.1 * size), fov=44,
                                  along=(-0.4, -0.35, -1.0))
    light = rt.PointLight(tuple(middle + size * np.array((2, 3, 2))), (0.8, 0.76, 0.7))
    fill = rt.PointLight(tuple(middle + size * np.array((-3, 2, 1))), (0.25, 0.27, 0.3))

    plain = rt.Material("grey", GREY)
    materials = [plain] * 5
    floor = rt.Material("floor", (0.45, 0.5, 0.4))
    step = rt.Scene(base.name, triangles, GREY, (), camera, stand_in=base.stand_in,
                    environment=rt.Environment.sky((0.55, 0.65, 0.8), (0.3, 0.28, 0.25)),
                    materials=tuple(materials), material_of=part_of)
    found = [step]

    def add(**said: object) -> None:
        nonlocal step
        said.setdefault("materials", tuple(materials))
        colours = np.array([m.diffuse for m in said["materials"]], np.float32)[part_of]
        step = replace(step, colours=colours, **said)
        found.append(step)

    add(lights=(light,))
    materials[FLOOR] = floor
    add()
    add(normals=normals)
    materials[FLOOR] = replace(floor, texture=checks)
    add(uv=uv)
    add(lights=(light, fill))
    materials[LAMP] = rt.Material("lamp", emission=(6, 5.6, 5))
    add()
    materials[FLOOR] = replace(materials[FLOOR], glossy=(0.3,) * 3, roughness=0.2)
    add()
    materials[BALL] = rt.Material("mirror", mirror=(0.9,) * 3)
    add()
    materials[GLASS] = rt.Material("glass", ior=1.5)
    add(environment=rt.Environment.surrounded(around))
    return tuple(found)
