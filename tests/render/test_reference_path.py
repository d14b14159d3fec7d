"""The float64 path tracer, the reference of other tests, is compared with formulas."""
from __future__ import annotations

import dataclasses

import numpy as np
import path_scenes
import pytest

import gpgpu_rt as rt
from gpgpu_rt.reference.path import PathPicture, path_picture
from gpgpu_rt.reference.path_settings import PathSettings
from gpgpu_rt.scene import light_choice
from gpgpu_rt.scene.light import Environment
from gpgpu_rt.scene.light_choice import LightChoice
from gpgpu_rt.scene.material import Material
from gpgpu_rt.scene.texture import Texture


def assert_within_noise(picture: PathPicture, expected: np.ndarray, closeness: float) -> None:
    """Check that each pixel is within 5.5 standard errors of ``expected``. The relative error of
    the picture's mean must be below ``closeness``."""
    off = np.abs(picture.mean - expected)
    assert (off <= 5.5 * picture.error + 1e-9).all()
    mean = np.broadcast_to(expected, off.shape).mean(axis=(0, 1))
    relative = np.abs(picture.mean.mean(axis=(0, 1)) / mean - 1)
    assert relative.max() < closeness


@pytest.mark.parametrize("roulette", [1, 4])
@pytest.mark.parametrize("seed", [3])
def test_furnace(seed: int, roulette: int) -> None:
    scene, expected = path_scenes.furnace()
    picture = path_picture(scene, (8, 8), 256, PathSettings(seed=seed, roulette=roulette))
    assert_within_noise(picture, expected, 0.005)


def test_a_white_ball_cannot_be_seen() -> None:
    scene, expected = path_scenes.white_ball()
    picture = path_picture(scene, (12, 12), 4, PathSettings(roulette=60))
    assert np.abs(picture.mean / expected - 1).max() < 1e-9


def test_mirror_box() -> None:
    scene, expected = path_scenes.mirror_box(30)
    picture = path_picture(scene, (8, 8), 2, PathSettings(bounces=30, roulette=60))
    assert np.abs(picture.mean / expected - 1).max() < 1e-9


@pytest.mark.parametrize("seed", [4])
def test_direct_light_of_a_polygon(seed: int) -> None:
    expected = path_scenes.lit_floor_radiance((6, 6))
    picture = path_picture(path_scenes.lit_floor(), (6, 6), 2000,
                           PathSettings(bounces=1, seed=seed))
    assert_within_noise(picture, expected, 0.006)


@pytest.mark.parametrize("seed", [5])
def test_point_lights(seed: int) -> None:
    scene, expected = path_scenes.point_lit_floor()
    picture = path_picture(scene, (4, 4), 1000, PathSettings(bounces=1, seed=seed))
    assert_within_noise(picture, expected, 0.01)


@pytest.mark.parametrize("seed", [6])
def test_glass_slab(seed: int) -> None:
    scene, expected = path_scenes.glass_slab()
    picture = path_picture(scene, (4, 4), 2000, PathSettings(seed=seed, roulette=60))
    assert_within_noise(picture, expected, 0.005)


@pytest.mark.parametrize("seed", [9])
def test_an_even_image_hides_a_white_ball(seed: int) -> None:
    scene, expected = path_scenes.image_lit_ball()
    picture = path_picture(scene, (8, 8), 1000, PathSettings(roulette=60, seed=seed))
    assert_within_noise(picture, expected, 0.005)


@pytest.mark.parametrize("seed", [10])
def test_direct_light_of_a_bright_texel(seed: int, monkeypatch) -> None:
    """Each pixel has the expected radiance within its noise, with and without direct sampling of
    the bright texel. Direct sampling lowers the noise to less than a fifth of its value."""
    scene, expected = path_scenes.image_lit_floor()
    settings = PathSettings(seed=seed, sampler="random")
    asked = path_picture(scene, (4, 4), 1000, settings)
    assert_within_noise(asked, expected, 0.01)
    monkeypatch.setattr(light_choice, "asks_surroundings", lambda scene: False)
    found = path_picture(scene, (4, 4), 1000, settings)
    assert (np.abs(found.mean - expected) < 5.5 * found.error).all()
    assert asked.error.mean() < 0.2 * found.error.mean()


@pytest.mark.parametrize("name", ["sky", "image"])
@pytest.mark.parametrize("seed", [11])
def test_sampling_surroundings_changes_only_the_noise(seed: int, name: str, monkeypatch) -> None:
    """Direct sampling of the surroundings changes only the noise. The scene is a room with all
    kinds of surface. All light comes through openings in the walls."""
    scene = path_scenes.everything() if name == "sky" else path_scenes.everything_under_an_image()
    dark = [dataclasses.replace(m, emission=(0, 0, 0)) for m in scene.materials]
    scene = dataclasses.replace(scene, materials=dark, lights=())
    settings = PathSettings(bounces=4, roulette=60, seed=seed, sampler="random")
    asked = path_picture(scene, (4, 4), 800, settings)
    monkeypatch.setattr(light_choice, "asks_surroundings", lambda scene: False)
    found = path_picture(scene, (4, 4), 800, settings)
    assert asked.error.mean() < found.error.mean()
    total = np.sqrt((asked.error ** 2 + found.error ** 2).sum((0, 1))) / 16
    assert (np.abs((asked.mean - found.mean).mean((0, 1))) < 4 * total).all()


@pytest.mark.parametrize("lamps", [0, 1])
@pytest.mark.parametrize("name, alone, beside", [("sky", 1, 0), ("image", 1, 0.5), ("dark", 0, 0)])
def test_how_often_surroundings_are_sampled(name: str, alone: float, beside: float,
                                            lamps: int) -> None:
    """The share of direct samples that go to the surroundings depends on the sky and on the
    lamps."""
    sky = {"sky": Environment.constant((9, 9, 9)), "image": path_scenes.image_sky(None, 9),
           "dark": path_scenes.image_sky(None, 0)}[name]
    scene = dataclasses.replace(path_scenes.point_lit_floor()[0], environment=sky)
    lights = LightChoice.of(dataclasses.replace(scene, lights=scene.lights[:lamps]))
    assert lights.far == pytest.approx(beside if lamps else alone)
    assert len(lights) == lamps + (lights.far > 0)


@pytest.mark.parametrize("seed", [12])
def test_directions_to_an_image_follow_their_density(seed: int) -> None:
    """Each region of the sphere receives the share of directions that the density predicts for
    it."""
    rng = np.random.default_rng(seed)
    texels = rng.random((5, 8, 3)) ** 3
    texels[1:3, 3], texels[3] = 0, 0            # dark texels and a dark row
    texels[0, 6] = 40
    sky = Environment.surrounded(Texture("sky", texels))
    light = sky.image_light
    drawn, radiance = light.draw(rng.random((400_000, 2)))
    assert np.abs(np.linalg.norm(drawn, axis=1) - 1).max() < 1e-12
    assert np.abs(sky.radiance(drawn) - radiance).max() < 1e-9
    up, turn = (np.arange(600) + 0.5) / 600 * np.pi - np.pi / 2, (np.arange(800) + 0.5) / 800
    up, turn = (a.ravel() for a in np.meshgrid(up, 2 * np.pi * turn - np.pi))
    all_of = np.stack([np.cos(up) * np.sin(turn), np.sin(up), -np.cos(up) * np.cos(turn)], 1)
    chance = (light.density(all_of, sky.radiance(all_of)) * np.cos(up) * np.pi / 600
              * 2 * np.pi / 800)
    assert abs(chance.sum() - 1) < 1e-3

    def counts(directions: np.ndarray, weights: np.ndarray) -> np.ndarray:
        return np.histogram2d(np.arcsin(directions[:, 1]) / np.pi + 0.5,
                              np.arctan2(directions[:, 0], -directions[:, 2]) / np.pi,
                              (12, 20), ((0, 1), (-1, 1)), weights=weights)[0]

    expected = counts(all_of, chance)
    found = counts(drawn, np.full(len(drawn), 1 / len(drawn)))
    assert (np.abs(found - expected) < 5 * np.sqrt(expected / len(drawn)) + 2e-5
            + 0.01 * expected).all()


@pytest.mark.parametrize("seed", [7])
def test_sampling_lights_changes_only_the_noise(seed: int, monkeypatch) -> None:
    """Direct sampling of a lamp changes only the noise. The lamp lights glossy and diffuse walls.
    Without direct sampling, paths find the lamp by chance."""
    scene = path_scenes.closed_box(diffuse=(0.4, 0.4, 0.4), glossy=(0.4, 0.3, 0.2), roughness=0.4)
    lamp = np.array([[[-0.9, 0.9, -0.9], [-0.9, 0.9, 0.9], [0.9, 0.9, 0.9]]], np.float32)
    scene = rt.Scene.from_arrays(
        np.concatenate([scene.triangles, lamp]).reshape(-1, 3), np.arange(39).reshape(-1, 3),
        materials=(scene.materials[0], Material(diffuse=(0.5,) * 3, emission=(2, 2, 2))),
        material_of=[0] * 12 + [1], lights=(), environment=None, camera=scene.camera)
    settings = PathSettings(bounces=4, roulette=60, seed=seed)
    asked = path_picture(scene, (4, 4), 800, settings)
    none = LightChoice(*(np.zeros(0, int),) * 2, *(np.zeros(0),) * 2, 0.0)
    monkeypatch.setattr(LightChoice, "of", lambda scene: none)
    found = path_picture(scene, (4, 4), 800, settings)
    assert asked.error.mean() < found.error.mean()
    error = np.hypot(asked.error, found.error)
    assert (np.abs(asked.mean - found.mean) < 5 * error).all()
    total = np.sqrt((error ** 2).sum((0, 1))) / 16
    assert (np.abs((asked.mean - found.mean).mean((0, 1))) < 4 * total).all()


@pytest.mark.parametrize("count", [1, 2, 3, 64, 5000])
@pytest.mark.parametrize("seed", [8])
def test_lights_are_chosen_as_often_as_they_shine(seed: int, count: int) -> None:
    """The chance of an emitting triangle is proportional to its area times its luminance."""
    rng = np.random.default_rng(seed)
    materials = tuple(Material(emission=rng.random(3) ** 4) for _ in range(count))
    scene = rt.Scene.from_arrays(rng.normal(size=(3 * count, 3)),
                                 np.arange(3 * count).reshape(-1, 3), materials=materials,
                                 material_of=np.arange(count),
                                 light=rt.PointLight((0, 9, 0), (0.1, 0.2, 0.3)))
    lights = LightChoice.of(scene)
    names = np.r_[np.arange(count), -1]
    assert sorted(lights.triangle) == sorted(names)
    chance = np.zeros(count + 1)                # the last entry is for the point light
    np.add.at(chance, lights.triangle, lights.keep / len(lights))
    np.add.at(chance, lights.alias, (1 - lights.keep.astype(float)) / len(lights))
    corners = scene.triangles.astype(float)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]),
                          axis=1) / 2
    shines = np.array([m.emission for m in materials]) @ (0.2126, 0.7152, 0.0722)
    assert np.abs(chance[:-1] - lights.density * area * shines).max() < 1e-6
    assert abs(chance[-1] - lights.point_probability[0]) < 1e-6 and abs(chance.sum() - 1) < 1e-6


def test_samples_do_not_depend_on_how_they_are_split() -> None:
    scene = path_scenes.cornell_lit()
    whole = path_picture(scene, (4, 4), 12)
    parts = [path_picture(scene, (4, 4), n, first_sample=first) for first, n in ((0, 5), (5, 7))]
    assert np.allclose(whole.mean, (5 * parts[0].mean + 7 * parts[1].mean) / 12, rtol=1e-12)


@pytest.mark.parametrize("wrong", [{"bounces": -1}, {"roulette": 0}, {"seed": 1 << 16},
                                   {"bounces": 2.5}])
def test_settings_that_make_no_sense_are_refused(wrong: dict) -> None:
    with pytest.raises(rt.Error, match="whole number"):
        PathSettings(**wrong)
