"""Scenes for tests of path tracing. Many functions also return the expected radiance."""
from __future__ import annotations

from dataclasses import replace

import numpy as np
import trimesh

import gpgpu_rt as rt
from gpgpu_rt.scene.attributes import smooth_normals
from gpgpu_rt.scene.light import Environment, PointLight
from gpgpu_rt.scene.material import Material
from gpgpu_rt.scene.texture import Texture

QUAD = [[0, 1, 2], [0, 2, 3]]
EMITTED = np.array((0.5, 0.4, 0.3))


def closed_box(**parts: object) -> rt.Scene:
    """Return a box of a single material, seen from inside."""
    box = trimesh.creation.box((2, 2, 2))
    return rt.Scene.from_arrays(box.vertices, box.faces, materials=(Material(**parts),), lights=(),
                                environment=None,
                                camera=rt.Camera((0.1, 0.2, 0.3), (0.9, 0.1, 0.2), fov=90))


def furnace(diffuse: float = 0.6) -> tuple[rt.Scene, np.ndarray]:
    """Return a box that emits and reflects light evenly, and the box's radiance.

    The radiance is emission / (1 - reflectance).
    """
    return closed_box(diffuse=(diffuse,) * 3, emission=EMITTED), EMITTED / (1 - diffuse)


def white_ball() -> tuple[rt.Scene, np.ndarray]:
    """Return a white convex body in light that is equal from all directions, and the light's
    radiance. All pixels must be as bright as the light."""
    ball = trimesh.creation.icosphere(subdivisions=2)
    light = np.array((0.7, 0.8, 0.9))
    return rt.Scene.from_arrays(ball.vertices, ball.faces, lights=(),
                                materials=(Material(diffuse=(1, 1, 1)),),
                                environment=Environment.constant(light)), light


def mirror_box(bounces: int) -> tuple[rt.Scene, np.ndarray]:
    """Return a box of mirrors that emit light, and the box's radiance. The radiance is a geometric
    series. Paths between mirrors are not random, so pictures of the box have no noise."""
    share = np.array((0.9, 0.8, 0.5))
    return closed_box(mirror=share, emission=EMITTED), EMITTED * sum(
        share ** k for k in range(bounces + 1))


def lit_floor() -> rt.Scene:
    """Return a floor under a rectangular lamp outside the picture."""
    floor = np.array([[-9, 0, -9], [-9, 0, 9], [9, 0, 9], [9, 0, -9]], float)
    lamp = np.array([[-0.5, 1, -0.25], [0.75, 1, -0.25], [0.75, 1.2, 0.5], [-0.5, 1.2, 0.5]])
    return rt.Scene.from_arrays(
        np.concatenate([floor, lamp]), [*QUAD, *(np.array(QUAD) + 4)],
        materials=(Material(diffuse=(0.8, 0.5, 0.2)), Material(emission=(3, 2, 1))),
        material_of=[0, 0, 1, 1], lights=(), environment=None,
        camera=rt.Camera((0.2, 0.9, 1.2), (0.2, 0, 0.2), fov=50))


def lit_floor_radiance(size: tuple[int, int], fine: int = 8) -> np.ndarray:
    """Return the radiance of the lit floor, (h, w, 3), averaged over the area of each pixel.

    Lambert's formula gives the irradiance from a polygonal light.
    """
    scene = lit_floor()
    width, height = size
    origins, directions = (a.reshape(-1, 3).astype(float)
                           for a in scene.camera.rays((width * fine, height * fine)))
    at = origins - origins[:, 1:2] / directions[:, 1:2] * directions
    corners = scene.triangles[2:].astype(float)
    corners = np.array([*corners[0], corners[1, 2]])
    to = corners - at[:, None]
    to /= np.linalg.norm(to, axis=2, keepdims=True)
    then = np.roll(to, -1, axis=1)
    normal = np.cross(to, then)
    angle = np.arccos(np.clip((to * then).sum(axis=2), -1, 1))
    seen = (angle * normal[:, :, 1] / np.linalg.norm(normal, axis=2)).sum(axis=1)
    irradiance = np.abs(seen) / 2
    light = irradiance[:, None] / np.pi * np.array((0.8, 0.5, 0.2)) * (3, 2, 1)
    return light.reshape(height, fine, width, fine, 3).mean(axis=(1, 3))


def point_lit_floor() -> tuple[rt.Scene, np.ndarray]:
    """Return a floor under two point lights in a vertical line, and the floor's radiance. The
    lower light does not block the upper light."""
    floor = np.array([[-9, 0, -9], [-9, 0, 9], [9, 0, 9], [9, 0, -9]], float)
    lights = PointLight((0, 1e6, 0), (0.5, 0.25, 1.0)), PointLight((0, 2e6, 0), (0.1, 0.2, 0.3))
    scene = rt.Scene.from_arrays(floor, QUAD, materials=(Material(diffuse=(0.8, 0.5, 0.2)),),
                                 lights=lights, environment=None,
                                 camera=rt.Camera((0.2, 0.9, 1.2), (0.2, 0, 0.2), fov=50))
    return scene, np.array((0.8, 0.5, 0.2)) * (0.6, 0.45, 1.3)


def image_sky(bright: tuple[int, int] | None, dim: float = 0.0, times: float = 100.0
              ) -> Environment:
    """Return a sky image of radiance ``dim``. Its texel ``bright`` (row, column) is brighter."""
    texels = np.full((16, 32, 3), dim)
    if bright is not None:
        texels[bright] = np.array((6, 5, 4)) * times
    return Environment.surrounded(Texture("sky", texels))


def image_lit_floor() -> tuple[rt.Scene, np.ndarray]:
    """Return a floor under a dark sky with a single bright texel, and the floor's radiance.

    The irradiance is the sum over fine patches of the sky. The radiance is the reflectance times
    the irradiance, divided by pi.
    """
    share = np.array((0.8, 0.5, 0.2))
    floor = np.array([[-9, 0, -9], [-9, 0, 9], [9, 0, 9], [9, 0, -9]], float)
    sky = image_sky((3, 20))
    scene = rt.Scene.from_arrays(floor, QUAD, materials=(Material(diffuse=tuple(share)),),
                                 lights=(), environment=sky,
                                 camera=rt.Camera((0.2, 0.9, 1.2), (0.2, 0, 0.2), fov=50))
    fine = 400
    up = (np.arange(fine) + 0.5) / fine * np.pi / 2
    turn = (np.arange(4 * fine) + 0.5) / (4 * fine) * 2 * np.pi
    up, turn = (a.ravel() for a in np.meshgrid(up, turn))
    across = np.cos(up)
    light = sky.radiance(np.stack([across * np.sin(turn), np.sin(up), across * np.cos(turn)], 1))
    patch = across * (np.pi / 2 / fine) ** 2
    return scene, share / np.pi * (light * (patch * np.sin(up))[:, None]).sum(axis=0)


def image_lit_ball() -> tuple[rt.Scene, np.ndarray]:
    """Return the white ball in an environment image of even brightness, and the ball's
    radiance."""
    scene, _ = white_ball()
    return replace(scene, environment=image_sky(None, 0.75)), np.full(3, 0.75)


def sunny_ball() -> rt.Scene:
    """Return a ball on a floor under a dim image with a bright texel.

    The bright texel, 1 of 512, sends seven times as much light as all other texels together.
    """
    ball = trimesh.creation.icosphere(subdivisions=2)
    floor = np.array([[-9, -1, -9], [-9, -1, 9], [9, -1, 9], [9, -1, -9]], float)
    return rt.Scene.from_arrays(
        np.concatenate([ball.vertices, floor]),
        np.concatenate([ball.faces, np.array(QUAD) + len(ball.vertices)]), lights=(),
        materials=(Material(diffuse=(0.6, 0.5, 0.4)),), environment=image_sky((3, 20), 0.2, 150),
        camera=rt.Camera((1, 2, 6), (0, -0.2, 0), fov=40))


def everything_under_an_image() -> rt.Scene:
    """Return the room of `everything`. Its openings show an environment image with a small sun."""
    return replace(everything(), environment=image_sky((5, 15), 0.5, 3))


def glass_slab(ior: float = 1.5) -> tuple[rt.Scene, np.ndarray]:
    """Return a pane of glass under a sky, and the radiance that the pane shows.

    The radiance includes all orders of reflection inside the pane. The camera is so far away, and
    its angle of view so small, that the whole picture shows one direction.
    """
    pane = trimesh.creation.box((4, 0.1, 4))
    zenith, ground = np.array((1.0, 0.6, 0.2)), np.array((0.1, 0.5, 0.9))
    angle = np.radians(60)
    eye = 1000 * np.array((np.sin(angle), np.cos(angle), 0))
    scene = rt.Scene.from_arrays(
        pane.vertices, pane.faces, materials=(Material(ior=ior),), lights=(),
        environment=Environment.sky(zenith, ground), camera=rt.Camera(tuple(eye), (0, 0, 0),
                                                                      fov=0.02))
    cosine = np.cos(angle)
    inner = np.sqrt(1 - (np.sin(angle) / ior) ** 2)
    across = (cosine - ior * inner) / (cosine + ior * inner)
    along = (ior * cosine - inner) / (ior * cosine + inner)
    once = (across ** 2 + along ** 2) / 2
    back = 2 * once / (1 + once)
    sky = [ground + (zenith - ground) * (0.5 + 0.5 * up) for up in (cosine, -cosine)]
    return scene, back * sky[0] + (1 - back) * sky[1]


def cornell_lit() -> rt.Scene:
    """Return the Cornell box under its lamp, with darkness outside."""
    return rt.load_scene("cornell-light")


def everything() -> rt.Scene:
    """Return a room with all kinds of surface and light, seen from inside.

    No formula gives its radiance.
    """
    rng = np.random.default_rng(3)
    room = trimesh.creation.box((4, 3, 4))
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.6)
    block = trimesh.creation.box((0.8, 0.8, 0.8))
    lamp = np.array([[-0.4, 1.4, -0.4], [0.4, 1.4, -0.4], [0.4, 1.4, 0.4], [-0.4, 1.4, 0.4]])
    meshes = [(room.vertices, room.faces), (ball.vertices + (-0.8, -0.9, -0.6), ball.faces),
              (ball.vertices + (0.9, -0.8, -0.4), ball.faces),
              (block.vertices + (0.2, -1.1, 0.7), block.faces), (lamp, np.array(QUAD))]
    material_of = np.repeat(np.arange(5), [len(faces) for _, faces in meshes])
    material_of[:2] = 5     # half of a wall and half of the floor are open
    triangles = np.concatenate([vertices[faces] for vertices, faces in meshes])
    keep = material_of != 5
    triangles, material_of = triangles[keep], material_of[keep]
    normals = smooth_normals(triangles)
    flat = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    round_ones = np.isin(material_of, (1, 2))
    normals[~round_ones] = (flat / np.linalg.norm(flat, axis=1, keepdims=True)
                            )[~round_ones, None]
    texture = Texture("noise", rng.random((8, 8, 3)))
    materials = (Material("walls", diffuse=(0.7, 0.7, 0.7), texture=texture),
                 Material("glass", ior=1.5),
                 Material("ball", diffuse=(0.2, 0.1, 0.1), mirror=(0.3, 0.3, 0.4),
                          glossy=(0.3, 0.4, 0.2), roughness=0.3),
                 Material("block", diffuse=(0.2, 0.5, 0.7), glossy=(0.2, 0.2, 0.2),
                          roughness=0.1),
                 Material("lamp", diffuse=(0.5, 0.5, 0.5), emission=(6, 5, 4)))
    return rt.Scene.from_arrays(
        triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3),
        materials=materials, material_of=material_of, normals=normals,
        uv=rng.random((len(triangles), 3, 2)),
        lights=(PointLight((1, 0.5, 1.5), (0.4, 0.5, 0.6)),),
        environment=Environment.sky((0.4, 0.6, 1.0), (0.2, 0.2, 0.1)),
        camera=rt.Camera((0.3, 0.2, 1.9), (0, -0.6, -0.5), fov=75))
