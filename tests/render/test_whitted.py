"""Whitted's ray tracing is compared with the laws of optics, and with itself under every
method."""
from __future__ import annotations

import numpy as np
import pytest
from looks import CAMERA, everything

import gpgpu_rt as rt
from gpgpu_rt.gl.textures import read_texture
from gpgpu_rt.render.needs import CUTOFF
from gpgpu_rt.scene.procedural.shapes import boxes, quad

DIM = rt.Environment.constant((0.25, 0.5, 0.75))


def radiance(tracer: rt.Tracer, size: tuple[int, int], **options: object) -> np.ndarray:
    """Draw a picture and return its linear radiance, (height, width, 3)."""
    tracer.render(size=size, **options)
    return stream(tracer, "radiance")[0][:, :, :3]


def stream(tracer: rt.Tracer, name: str) -> list[np.ndarray]:
    """Return the textures of the named stream of the latest picture, one array per texture."""
    with tracer.gpu:
        room = tracer.sessions.pictures.integrator.room
        return [read_texture(texture) for texture in room.textures(name)]


def scene_of(triangles: np.ndarray, material: rt.Material, camera: rt.Camera,
             environment: rt.Environment | None = DIM, **said: object) -> rt.Scene:
    return rt.Scene("made", triangles, material.diffuse, (), camera, materials=(material,),
                    environment=environment, **said)


def test_a_box_of_mirrors_adds_up_to_a_geometric_series() -> None:
    """All walls emit light. Float32 holds the reflected shares exactly. The radiance equals the
    series only if no ray leaves the box, is lost or counts twice."""
    wall = rt.Material("wall", mirror=(0.5, 0.25, 0.0), emission=(0.125, 0.25, 1))
    camera = rt.Camera((0.3, 0.4, 0.45), (1, 0.7, 0.1), fov=100)
    scene = scene_of(boxes((0, 0, 0), (1, 1, 1)), wall, camera, None)
    with rt.Tracer(scene) as tracer:
        light = radiance(tracer, (48, 48), bounces=5, light_samples=1, integrator="whitted")
    series = np.array([sum(r ** k for k in range(6)) for r in (0.5, 0.25, 0.0)])
    assert np.abs(light / (wall.emission * series) - 1).max() < 1e-6


def fresnel(cosine: np.ndarray, ior: float) -> np.ndarray:
    """Return the Fresnel reflectance by the textbook formula, in float64. Past the critical angle,
    the reflectance is 1."""
    sine = np.sqrt(1 - cosine ** 2) / ior
    beyond = np.sqrt(np.maximum(1 - sine ** 2, 0))
    across = (cosine - ior * beyond) / (cosine + ior * beyond)
    along = (ior * cosine - beyond) / (ior * cosine + beyond)
    return np.where(sine < 1, (across ** 2 + along ** 2) / 2, 1.0)


@pytest.mark.parametrize("ior", [1.5, 1.1, 2.4, 1 / 1.5])
def test_a_slab_of_glass_reflects_and_lets_through_by_fresnel(ior: float) -> None:
    """The expected radiance is a sum over all paths that leave the slab after at most six turns.

    A turn is a reflection or a refraction. The sky is brighter behind the slab than in front of
    it. Light that is still inside after six turns splits once more into a reflected share and a
    refracted share. No further ray is traced: each share gets the radiance of the sky in its
    direction, even the reflected share, which stays inside.
    """
    camera = rt.Camera((0, 0, 3), (0.8, 0.5, 0), fov=70)
    slab = boxes((-500, -500, -0.5), (500, 500, 0.5))
    sky = rt.Environment.surrounded(rt.Texture("halves", np.ones((4, 8, 3)) * np.where(
        np.abs(np.arange(8) - 3.5) < 2, 1.0, 0.25)[:, None]))    # the middle columns are -z
    scene = scene_of(slab, rt.Material("glass", ior=ior), camera, sky)
    with rt.Tracer(scene) as tracer:
        light = radiance(tracer, (32, 24), bounces=6)[:, :, 0]
    directions = camera.rays((32, 24))[1].astype(np.float64)
    f = fresnel(-directions[..., 2], ior)
    expected, sure = np.zeros(f.shape), np.ones(f.shape, bool)
    for turns in range(1, 7):
        weight = f if turns == 1 else (1 - f) ** 2 * f ** (turns - 2)
        behind = turns % 2 == 0
        radiance_there = np.where(behind, 1.0, 0.25)
        expected += np.where(weight >= CUTOFF, weight * radiance_there, 0)
        sure &= np.abs(weight / CUTOFF - 1) > 1e-3
    rest = (1 - f) * f ** 5     # the share still inside, travelling towards the camera's side
    for share, there in ((f, 1.0), (1 - f, 0.25)):
        weight = rest * share
        expected += np.where(weight >= CUTOFF, weight * there, 0)
        sure &= np.abs(weight / CUTOFF - 1) > 1e-3
    sine = directions[..., 0] / ior
    sure &= (np.abs(sine) < 0.87 * np.sqrt(np.maximum(1 - (directions[..., 1] / ior) ** 2, 0))
             ) | (rest * f < CUTOFF)
    # Near the border between the bright and the dark half, filtering blends the texels.
    angle = np.abs(np.arctan2(directions[..., 0], -directions[..., 2]))
    sure &= (np.abs(angle - np.pi / 2) > 0.5) & (np.abs(f - 1) > 1e-6)
    assert sure.mean() > 0.5 and np.abs(light - expected)[sure].max() < 1e-4


def test_refracted_rays_obey_snell() -> None:
    camera = rt.Camera((0, 0, 3), (0.8, 0.5, 0), fov=70)
    glass = rt.Material("glass", ior=1.5)
    with rt.Tracer(scene_of(boxes((-500, -500, -1), (500, 500, 0)), glass, camera)) as tracer:
        radiance(tracer, (32, 24), bounces=1)
        into = stream(tracer, "refracted 1")[1][:, :, :3].astype(np.float64)
        back = stream(tracer, "reflected 1")[1][:, :, :3]
    d = camera.rays((32, 24))[1].astype(np.float64)
    sine = np.linalg.norm(d[..., :2], axis=2) / 1.5
    assert np.abs(np.linalg.norm(into[..., :2], axis=2) - sine).max() < 1e-6
    across = into[..., 0] * d[..., 1] - into[..., 1] * d[..., 0]
    assert np.abs(across).max() < 1e-6 and (into[..., 2] < 0).all()
    assert np.abs(back - d * (1, 1, -1)).max() < 1e-6


def test_light_inside_glass_is_reflected_totally_past_the_critical_angle() -> None:
    camera = rt.Camera((0, 0, -0.5), (0, 0, 0), fov=140)
    glass = rt.Material("glass", ior=1.5)
    with rt.Tracer(scene_of(boxes((-500, -500, -1), (500, 500, 0)), glass, camera)) as tracer:
        radiance(tracer, (33, 33), bounces=1)
        share = stream(tracer, "reflected 1 paths")[0][:, :, 0]
        onward = stream(tracer, "refracted 1 paths")[0][:, :, 0]
    cosine = camera.rays((33, 33))[1][..., 2].astype(np.float64)
    expected = fresnel(cosine, 1 / 1.5)
    sure = np.abs(np.sqrt(1 - cosine ** 2) * 1.5 - 1) > 1e-4
    assert np.abs(share - expected)[sure].max() < 1e-4
    total = sure & (expected == 1)
    assert total.sum() > 100 and (share[total] == 1).all() and not onward[total].any()


def test_a_square_lamp_lights_a_floor_as_its_form_factor_says() -> None:
    """Lambert's formula gives the exact form factor. The mean error must be much smaller than the
    noise of a pixel."""
    lamp = quad((-1, 2, -1), (1, 2, -1), (1, 2, 1), (-1, 2, 1))
    floor = quad((-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9))
    materials = (rt.Material("floor", (0.5,) * 3), rt.Material("lamp", emission=(4,) * 3))
    camera = rt.Camera((0, 1.2, 0), (0.0, 0, 0.0), up=(0, 0, -1), fov=90)
    scene = rt.Scene("lamp", np.concatenate([floor, lamp]), (0.5,) * 3, (), camera,
                     materials=materials, material_of=[0, 0, 1, 1], environment=None)
    size = (24, 24)
    with rt.Tracer(scene) as tracer:
        light = radiance(tracer, size, light_samples=64)[:, :, 0]
    origins, directions = (a.astype(np.float64) for a in camera.rays(size))
    at = origins + directions * (-1.2 / directions[..., 1:2])
    corners = lamp[[0, 0, 0, 1], [0, 1, 2, 2]] - at[..., None, :]
    unit = corners / np.linalg.norm(corners, axis=-1, keepdims=True)
    following = np.roll(unit, -1, axis=-2)
    turn = np.cross(unit, following)
    angle = np.arccos((unit * following).sum(-1)) / np.linalg.norm(turn, axis=-1)
    factor = np.abs((angle * turn[..., 1]).sum(-1)) / (2 * np.pi)
    error = light / (0.5 * 4 * factor) - 1
    assert abs(error.mean()) < 2e-3 and np.abs(error).max() < 0.1


def test_smooth_normals_shade_a_ball_as_a_ball() -> None:
    """Smooth normals give the brightness of a round ball, except at the ball's rim. At the rim, a
    light behind a triangle must not shine through the triangle."""
    from gpgpu_rt.scene.attributes import smooth_normals
    from gpgpu_rt.scene.procedural.shapes import ball
    triangles = ball(320)
    camera = rt.Camera((0, 0, 6), (0, 0, 0), fov=14)
    light = rt.PointLight((0, 0, 60), (1, 1, 1))
    scene = rt.Scene("ball", triangles, (1, 1, 1), light, camera, environment=None,
                     normals=smooth_normals(triangles))
    with rt.Tracer(scene) as tracer:
        drawn = np.asarray(tracer.render(size=(32, 32)))[:, :, 0] / 255
    linear = np.where(drawn <= 0.04045, drawn / 12.92, ((drawn + 0.055) / 1.055) ** 2.4)
    origins, directions = (a.astype(np.float64) for a in camera.rays((32, 32)))
    b = (origins * directions).sum(-1)
    inside = b * b - ((origins ** 2).sum(-1) - 0.9 ** 2) > 0
    height = np.sqrt(np.maximum(b * b - ((origins ** 2).sum(-1) - 1), 0))
    z = (origins + (-b - height)[..., None] * directions)[..., 2]
    assert inside.sum() > 300 and np.abs(linear - z)[inside].max() < 0.06


@pytest.mark.parametrize("method", [row.name for row in rt.methods()])
def test_every_method_draws_the_same_picture(precise_renderer, method: str) -> None:
    """All methods draw the same picture of a scene with glass, mirrors, a lamp, a point light,
    textures and smooth normals."""
    assert (picture(method) == picture("brute-force")).all()


PICTURES: dict[str, np.ndarray] = {}


def picture(method: str) -> np.ndarray:
    if method not in PICTURES:
        with rt.Tracer(everything(), method) as tracer:
            PICTURES[method] = np.asarray(tracer.render(CAMERA, (20, 14), bounces=2,
                                                        light_samples=1))
    return PICTURES[method]


def drawn(scene: rt.Scene, method: str = "bvh-threaded", all_features: bool = False,
          **options: object) -> np.ndarray:
    with rt.Tracer(scene, method, **options) as tracer:
        return np.asarray(tracer.render(CAMERA, (20, 14), bounces=2, light_samples=1,
                                        all_features=all_features))


@pytest.mark.parametrize("options", [
    {"schedule": "step"}, {"schedule": "kernels"}, {"sort_rays": True}, {"statistics": True},
    {"octants": True}], ids=str)
def test_how_rays_are_traced_does_not_show(precise_renderer, options: dict[str, object]) -> None:
    """Schedules, sorting, statistics and octants do not change the picture."""
    assert (drawn(everything(), **options) == picture("brute-force")).all()


@pytest.mark.parametrize("precision, most", [("fp24", 0.1), ("fp16", 3.0)])
def test_low_precision_shows_little(precise_renderer, precision: str, most: float) -> None:
    """Low precision changes the picture little. The option all_features, which builds the programs
    with every feature, does not change the picture of low precision."""
    derived = drawn(everything(), precision=precision)
    assert np.abs(derived.astype(int) - picture("brute-force")).mean() < most
    assert (drawn(everything(), all_features=True, precision=precision) == derived).all()


def test_an_updated_picture_equals_a_new_tracers_picture(precise_renderer) -> None:
    """After an update, the picture equals a new tracer's picture of the moved scene."""
    scene = everything()
    triangles = scene.triangles * np.float32(1.1) + np.float32(0.05)
    with rt.Tracer(scene) as tracer:
        before = np.asarray(tracer.render(CAMERA, (20, 14), bounces=2, light_samples=1))
        tracer.update(triangles)
        after = np.asarray(tracer.render(CAMERA, (20, 14), bounces=2, light_samples=1))
    assert (after == drawn(scene.moved(triangles))).all() and (after != before).any()


@pytest.mark.parametrize("all_features", [False, True])
def test_an_empty_scene_is_its_environment(all_features: bool) -> None:
    empty = rt.Scene.from_arrays(np.zeros((0, 3)), np.zeros((0, 3), int), environment=DIM)
    pixels = drawn(empty, all_features=all_features).reshape(-1, 3)
    assert (pixels == pixels[0]).all() and pixels[0].tolist() == [137, 188, 225]
