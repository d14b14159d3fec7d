"""Small test scenes: one scene for each property of appearance (such as a mirror or a point
light), and one scene that combines many properties."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.scene.attributes import smooth_normals
from gpgpu_rt.scene.light import BACKDROP, Environment, PointLight
from gpgpu_rt.scene.material import Material
from gpgpu_rt.scene.procedural.shapes import ball, boxes, quad
from gpgpu_rt.scene.texture import Texture

CAMERA = rt.Camera((0.5, 2.5, 6.0), (0, 0.6, 0), fov=40)
POINT = PointLight((3, 5, 4), (0.9, 0.8, 0.7))
CHECKS = Texture("checks", np.kron([[0.1, 0.9], [0.7, 0.2]], np.ones((3, 3)))[..., None]
                 * np.array((1.0, 0.8, 0.6)))


def plain() -> rt.Scene:
    """Return a scene that needs almost no features of a renderer: grey shapes on a floor under a
    sky of one colour."""
    parts = [quad((-3, 0, 3), (3, 0, 3), (3, 0, -3), (-3, 0, -3)),
             ball(80, (-0.9, 0.8, 0), (0.8,) * 3), boxes((0.3, 0, -0.6), (1.5, 1.1, 0.6)),
             quad((-0.6, 3, -0.6), (0.6, 3, -0.6), (0.6, 3, 0.6), (-0.6, 3, 0.6))]
    triangles = np.concatenate(parts)
    scene = rt.Scene("plain", triangles, (0.6, 0.58, 0.54), (), CAMERA,
                     environment=Environment.constant((0.8, 0.8, 0.8)),
                     material_of=None)
    return replace(scene, material_of=np.zeros(len(triangles), np.int32))


def part_of(scene: rt.Scene) -> np.ndarray:
    """Return each triangle's part in `plain`, (n,): 0 floor, 1 ball, 2 box, 3 lamp."""
    count = len(scene)
    return np.repeat(np.arange(4), (2, count - 16, 12, 2))


def with_material(scene: rt.Scene, part: int, material: Material) -> rt.Scene:
    """Return the scene with another material on one part."""
    rows, colours = scene.material_of.copy(), scene.colours.copy()
    chosen = part_of(scene) == part
    rows[chosen], colours[chosen] = len(scene.materials), material.diffuse
    return replace(scene, materials=(*scene.materials, material), material_of=rows,
                   colours=colours)


def _grey(scene: rt.Scene, **said: object) -> Material:
    """Return the scene's grey material with the given properties added."""
    return Material("other", tuple(scene.colours[0].tolist()), **said)


def textured(scene: rt.Scene) -> rt.Scene:
    uv = np.zeros((len(scene), 3, 2), np.float32)
    uv[:2] = 2 * np.float32([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]])
    return with_material(replace(scene, uv=uv), 0, _grey(scene, texture=CHECKS))


def smooth(scene: rt.Scene) -> rt.Scene:
    normals = smooth_normals(scene.triangles)
    normals[part_of(scene) != 1] = 0
    return replace(scene, normals=normals)


def image_sky(scene: rt.Scene) -> rt.Scene:
    rows = np.linspace(1, 0.1, 8)[:, None, None] * np.array((0.6, 0.8, 1.0))
    return replace(scene, environment=Environment.surrounded(
        Texture("gradient", np.broadcast_to(rows, (8, 16, 3)))))


ALONE: dict[str, Callable[[rt.Scene], rt.Scene]] = {
    "colours": lambda s: replace(s, colours=s.colours * (1 - 0.1 * part_of(s)[:, None])),
    "smooth normals": smooth,
    "textures": textured,
    "emitters": lambda s: with_material(s, 3, _grey(s, emission=(4, 4, 3))),
    "glossy": lambda s: with_material(s, 1, _grey(s, glossy=(0.3,) * 3)),
    "point light": lambda s: replace(s, lights=(POINT,)),
    "two point lights": lambda s: replace(s, lights=(POINT, PointLight((-4, 4, 2), (0.3,) * 3))),
    "mirrors": lambda s: with_material(s, 1, _grey(s, mirror=(0.4,) * 3)),
    "dielectrics": lambda s: with_material(s, 1, Material("glass", ior=1.5)),
    "darkness": lambda s: replace(s, environment=None),
    "backdrop": lambda s: replace(s, environment=BACKDROP),
    "environment image": image_sky,
    "moving": lambda s: replace(s, moving=True),
}


def everything() -> rt.Scene:
    """Return a scene with smooth normals, a texture, glass, a material with mirror and glossy
    parts, a lamp, a point light and an image as its environment."""
    scene = image_sky(smooth(textured(plain())))
    scene = with_material(scene, 1, Material("glass", ior=1.5))
    scene = with_material(scene, 2, Material("metal", (0.2, 0.1, 0.1), mirror=(0.4,) * 3,
                                             glossy=(0.3,) * 3))
    scene = with_material(scene, 3, Material("lamp", emission=(4, 4, 3)))
    return replace(scene, lights=(POINT,))
