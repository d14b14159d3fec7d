"""The path integrator is compared with formulas, with the float64 path tracer ("twin"), with an
independent renderer's picture, and with itself under other settings."""
from __future__ import annotations

import dataclasses

import numpy as np
import path_scenes
import pytest
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt.figures.experiments.path_errors import cornell_truth, relative_error, truth_noise
from gpgpu_rt.reference.path import path_picture
from gpgpu_rt.reference.path_settings import PathSettings
from gpgpu_rt.render import needs, path
from gpgpu_rt.scene import light_choice
from gpgpu_rt.scene.luminance import LUMINANCE
from gpgpu_rt.scene.material import Material

SCENES = {"furnace": lambda: path_scenes.furnace()[0], "floor": path_scenes.lit_floor,
          "points": lambda: path_scenes.point_lit_floor()[0],
          "slab": lambda: path_scenes.glass_slab()[0], "cornell": path_scenes.cornell_lit,
          "everything": path_scenes.everything, "ball": lambda: path_scenes.white_ball()[0],
          "image on ball": lambda: path_scenes.image_lit_ball()[0],
          "image on floor": lambda: path_scenes.image_lit_floor()[0],
          "image": path_scenes.everything_under_an_image}


def radiance(scene: rt.Scene, size: tuple[int, int], samples: int, method: str = "bvh-threaded",
             tracer_options: dict | None = None, **options: object) -> np.ndarray:
    """Return (h, w, 3) radiance, the mean of the samples."""
    with rt.Tracer(scene, method, **(tracer_options or {})) as tracer:
        tracer.render(size=size, integrator="path", samples=samples, **options)
        return tracer.radiance


@pytest.mark.parametrize("name, sampler", [*((name, "sobol") for name in SCENES),
                                           ("everything", "random")])
def test_shaders_agree_with_the_float64_twin(name: str, sampler: str) -> None:
    """The shaders and the float64 path tracer trace the same paths, except for a few paths that
    rounding changes."""
    scene = SCENES[name]()
    found = radiance(scene, (16, 16), 32, seed=2, sampler=sampler)
    truth = path_picture(scene, (16, 16), 32, PathSettings(seed=2, sampler=sampler))
    off = np.abs(found - truth.mean)
    assert off.mean() < 2e-4 * truth.mean.mean()
    assert (off < 0.02 * truth.error + 1e-5 * truth.mean.mean()).mean() > 0.99


@pytest.mark.parametrize("seed", [11])
def test_cornell_box_within_its_noise(seed: int) -> None:
    """The two pictures use different random numbers, and differ only by their noise."""
    scene = path_scenes.cornell_lit()
    found = radiance(scene, (16, 16), 128, seed=seed)
    truth = path_picture(scene, (16, 16), 128, PathSettings(seed=seed + 1))
    off = np.abs(found - truth.mean)
    # A difference has sqrt(2) times the noise. A factor of 2 also allows for long tails.
    assert off.mean() < 2 * truth.error.mean()
    total = np.sqrt(2 * (truth.error ** 2).sum(axis=(0, 1)))
    assert (np.abs((found - truth.mean).sum(axis=(0, 1))) < 4 * total).all()


@pytest.mark.full
@pytest.mark.once
def test_cornell_box_at_4096_samples() -> None:
    """The mean relative error at 64 x 64 against an independent renderer's picture is small.

    Without the noise of this renderer's picture, the mean error of the luminance is below 1 %. The
    mean error of the channels, dark channels included, is below 1.15 %.
    """
    found = radiance(path_scenes.cornell_lit(), (64, 64), 4096, roulette=16)
    truth = cornell_truth()[0]
    error = relative_error(found, truth), relative_error(found @ LUMINANCE, truth @ LUMINANCE)
    print(f"mean relative error: {error[0]:.2%} in a channel, {error[1]:.2%} in the luminance; "
          f"noise of the truth: {truth_noise():.2%}")
    assert error[0] < np.hypot(0.0115, truth_noise())
    assert error[1] < np.hypot(0.01, truth_noise())


@pytest.mark.parametrize("seed", [12])
def test_cornell_box_agrees_with_another_renderer(seed: int) -> None:
    """In each channel, the mean of each quarter of the picture agrees with the same quarter of an
    independent renderer's picture. A few samples suffice for these means."""
    truth = cornell_truth()[0]
    found = radiance(path_scenes.cornell_lit(), (64, 64), 16, seed=seed)
    for rows, columns in ((slice(0, 32), slice(0, 32)), (slice(0, 32), slice(32, 64)),
                          (slice(32, 64), slice(0, 32)), (slice(32, 64), slice(32, 64))):
        quarter = (found[rows, columns].mean(axis=(0, 1))
                   / truth[rows, columns].mean(axis=(0, 1)))
        assert np.abs(quarter - 1).max() < 0.02


@pytest.mark.parametrize("diffuse", [0.3, 0.8])
def test_furnace(diffuse: float) -> None:
    """In a box that emits and reflects evenly, the mean radiance follows from a geometric
    series."""
    scene, expected = path_scenes.furnace(diffuse)
    found = radiance(scene, (16, 16), 256)
    assert np.abs(found.mean(axis=(0, 1)) / expected - 1).max() < 0.005


def test_a_white_ball_cannot_be_seen() -> None:
    """A white ball in even light is as bright as the light around it."""
    scene, expected = path_scenes.white_ball()
    assert np.abs(radiance(scene, (24, 24), 2, roulette=60) / expected - 1).max() < 2e-6


def test_mirror_box() -> None:
    scene, expected = path_scenes.mirror_box(30)
    found = radiance(scene, (8, 8), 2, bounces=30, roulette=60)
    assert np.abs(found / expected - 1).max() < 1e-5


def test_direct_light_of_a_polygon() -> None:
    found = radiance(path_scenes.lit_floor(), (6, 6), 4096, bounces=1)
    expected = path_scenes.lit_floor_radiance((6, 6))
    assert np.abs(found / expected - 1).max() < 0.05
    assert np.abs(found.mean(axis=(0, 1)) / expected.mean(axis=(0, 1)) - 1).max() < 0.004


def test_a_white_ball_in_an_even_image() -> None:
    scene, expected = path_scenes.image_lit_ball()
    found = radiance(scene, (16, 16), 512, roulette=60)
    assert np.abs(found.mean(axis=(0, 1)) / expected - 1).max() < 0.005


def test_direct_light_of_a_bright_texel() -> None:
    scene, expected = path_scenes.image_lit_floor()
    found = radiance(scene, (6, 6), 1024)
    assert np.abs(found / expected - 1).max() < 0.02
    assert np.abs(found.mean(axis=(0, 1)) / expected - 1).max() < 0.003


@pytest.mark.parametrize("seed", [13])
def test_asking_finds_a_small_sun(seed: int, monkeypatch) -> None:
    """Direct sampling of a small sun lowers the error to less than a tenth.

    docs/path-tracing.md quotes the two errors that this test prints.
    """
    scene = path_scenes.sunny_ball()
    truth = radiance(scene, (24, 24), 4096, seed=seed + 1)
    asked = relative_error(radiance(scene, (24, 24), 64, seed=seed), truth)
    for module in (light_choice, needs):
        monkeypatch.setattr(module, "asks_surroundings", lambda scene: False)
    met = relative_error(radiance(scene, (24, 24), 64, seed=seed), truth)
    print(f"mean relative error at 64 samples: {asked:.2%} if paths sample the sun "
          f"directly, {met:.2%} if they meet it by chance")
    assert asked < 0.1 * met


def test_glass_slab() -> None:
    scene, expected = path_scenes.glass_slab()
    found = radiance(scene, (4, 4), 4096, roulette=60)
    assert np.abs(found.mean(axis=(0, 1)) / expected - 1).max() < 0.004


@pytest.mark.parametrize("method", [row.name for row in rt.methods()])
def test_every_method_draws_the_same_bits(precise_renderer, method: str) -> None:
    scene = path_scenes.cornell_lit()
    expected = _reference_bits(scene)
    assert (radiance(scene, (6, 6), 4, method, bounces=3) == expected).all()


@pytest.mark.parametrize("method", [row.name for row in rt.methods()])
def test_every_method_draws_the_same_bits_under_an_image(precise_renderer, method: str) -> None:
    scene = path_scenes.image_lit_ball()[0]
    assert (radiance(scene, (6, 6), 4, method, bounces=2) == _image_bits(scene)).all()


@pytest.mark.full
@pytest.mark.parametrize("method", [row.name for row in rt.methods()])
def test_every_method_draws_the_same_bits_of_everything(precise_renderer, method: str) -> None:
    scene = path_scenes.everything_under_an_image()
    expected = radiance(scene, (16, 16), 8)
    assert (radiance(scene, (16, 16), 8, method) == expected).all()


@pytest.mark.parametrize("options", [{"schedule": "step"}, {"schedule": "kernels"},
                                     {"sort_rays": True}], ids=str)
def test_every_schedule_draws_the_same_bits(precise_renderer, options: dict) -> None:
    scene = path_scenes.cornell_lit()
    assert (radiance(scene, (6, 6), 4, "kd-restart", options, bounces=3)
            == _reference_bits(scene)).all()


def _reference_bits(scene: rt.Scene, kept: list[np.ndarray] = []) -> np.ndarray:
    if not kept:
        kept.append(radiance(scene, (6, 6), 4, bounces=3))
    return kept[0]


def _image_bits(scene: rt.Scene, kept: list[np.ndarray] = []) -> np.ndarray:
    if not kept:
        kept.append(radiance(scene, (6, 6), 4, bounces=2))
    return kept[0]


@pytest.mark.parametrize("samples", [13, 64])
def test_the_size_of_waves_changes_nothing(precise_renderer, monkeypatch, samples: int) -> None:
    scene = path_scenes.cornell_lit()
    expected = radiance(scene, (8, 6), samples)
    for wave in (1, 200, 700):
        monkeypatch.setattr(path, "WAVE", wave)
        assert (radiance(scene, (8, 6), samples) == expected).all()


@pytest.mark.parametrize("name", ["cornell", "ball", "image on floor"])
def test_all_features_draw_the_same_bits(exact_renderer, name: str) -> None:
    scene = SCENES[name]()
    with rt.Tracer(scene) as tracer:
        tracer.render(size=(8, 8), integrator="path", samples=4)
        derived, plain = tracer.radiance, tracer.statistics.texture_bytes
        tracer.render(size=(8, 8), integrator="path", samples=4, all_features=True)
        assert (tracer.radiance == derived).all()
        assert tracer.statistics.texture_bytes > plain


def test_sums_of_4096_samples_lose_nothing() -> None:
    """Every path of a background pixel returns the same radiance, so the mean is this radiance
    rounded to float32."""
    scene, light = path_scenes.white_ball()
    with rt.Tracer(scene) as tracer:
        tracer.render(rt.Camera.looking_at(scene.bounds), (4, 4), "path", samples=4096,
                      bounces=0)
        background = tracer.radiance[0, 0]
        assert (background == np.float32(light)).all()


def test_seeds_differ_and_repeat() -> None:
    scene = path_scenes.cornell_lit()
    first, again, other = (radiance(scene, (8, 8), 4, seed=seed) for seed in (1, 1, 2))
    assert (first == again).all() and not np.allclose(first, other)


@pytest.mark.parametrize("sampler, least, most", [("random", 0.3, 1.5), ("sobol", 0, 0.6)])
def test_noise_target_stops_and_progress_is_reported(monkeypatch, sampler: str, least: float,
                                                     most: float) -> None:
    """Rendering stops at the noise target, and reports its progress after every wave. A wave is
    the paths that are traced at once."""
    monkeypatch.setattr(path, "WAVE", 16 * 64)
    scene = path_scenes.cornell_lit()
    with rt.Tracer(scene) as tracer:
        told: list[tuple[int, int, float]] = []
        tracer.render(size=(8, 8), integrator="path", samples=4096, noise=0.1, bounces=2,
                      sampler=sampler, progress=lambda *now: told.append(now))
        done, of, noise = told[-1]
        assert 64 <= done < 4096 and of == 4096 and noise <= 0.1 < told[-2][2]
        assert [row[0] for row in told] == list(range(16, done + 1, 16))
        # The reported noise is right for independent samples. For Sobol' samples, it is too large.
        few = tracer.radiance
        tracer.render(size=(8, 8), integrator="path", samples=2048, bounces=2, seed=9)
        off = (few - tracer.radiance) @ (0.2126, 0.7152, 0.0722)
        assert least < np.abs(off).mean() / tracer.radiance.mean() / noise < most


@pytest.mark.parametrize("wrong", [{"samples": 0}, {"noise": -1.0}, {"seed": 1 << 16},
                                   {"bounces": 5000}, {"roulette": 0}, {"glow": 1},
                                   {"sampler": "halton"}], ids=str)
def test_options_that_make_no_sense_are_refused(wrong: dict) -> None:
    with rt.Tracer(path_scenes.cornell_lit()) as tracer:
        with pytest.raises(rt.Error) as refusal:
            tracer.render(size=(4, 4), integrator="path", **wrong)
    assert "\n" not in str(refusal.value) and next(iter(wrong)) in str(refusal.value)


@pytest.mark.parametrize("name, adds", [
    ("dark", set()), ("point", {"light_choice", "point_light"}),
    ("lamp", {"emission", "light_choice"}), ("sky", {"light_choice"}),
    ("sky and lamp", {"emission", "light_choice"}),
    ("image", {"light_choice", "surroundings_image", "surroundings_sums", "surroundings_row"})])
def test_each_light_adds_only_what_it_needs(name: str, adds: set[str]) -> None:
    """Each light adds only the textures that it needs.

    Any light adds shadow rays and their light. The other textures hold tables of lights, the
    emission of materials, and an environment image with its sums. Shadow rays sample an even sky
    only if the scene has no other light.
    """
    floor = path_scenes.point_lit_floor()[0]
    lit = [Material(diffuse=(0.5,) * 3, emission=(1, 1, 1) if "lamp" in name else (0, 0, 0))]
    sky = path_scenes.image_sky(None, 1) if name == "image" else (
        rt.Environment.constant((1, 1, 1)) if "sky" in name else None)
    scene = dataclasses.replace(floor, materials=lit, lights=floor.lights[:name == "point"],
                                environment=sky)
    always = {"surface", "triangle", "eye rays", "state and hits", "next rays", "walk 0",
              "walk 1", "lit", "radiance", "sums 0", "sums 1"}
    with rt.Tracer(scene, "brute-force") as tracer:
        plan = tracer.plan(size=(8, 8), integrator="path")
        own = {kind for kind in plan.textures if not kind.startswith("the method's")}
        assert own == always | adds | ({"shadow rays", "direct"} if adds else set())
        assert ("ASKED_LIGHTS" in plan.defines) == bool(adds) and "PATHS" in plan.defines
        assert ("ASKED_SURROUNDINGS" in plan.defines) == (name in ("sky", "image"))
        assert ("ASKED_IMAGE" in plan.defines) == (name == "image")
        assert plan.left_out["texture"].get("point_light", "") == (
            "" if name == "point" else "there is no point light")
        tracer.render(size=(8, 8), integrator="path")
        assert tracer.statistics.texture_bytes == sum(plan.textures.values())
        other = tracer.plan(size=(8, 8))
    assert other.left_out["define"]["PATHS"] == "no paths are traced"


def test_an_empty_scene_shows_its_surroundings() -> None:
    empty = rt.Scene.from_arrays(np.zeros((0, 3)), np.zeros((0, 3), int), lights=(),
                                 environment=rt.Environment.constant((0.25, 0.5, 1)))
    assert np.allclose(radiance(empty, (4, 4), 2), (0.25, 0.5, 1))


def test_render_command(capsys, tmp_path) -> None:
    from gpgpu_rt.cli import main
    target = tmp_path / "box.png"
    assert main(["render", "cornell", "--integrator", "path", "--samples", "20", "--noise", "9",
                 "--bounces", "2", "--size", "10x8", "-o", str(target)]) == 0
    out = capsys.readouterr().out
    assert "16 samples per pixel, noise" in out and Image.open(target).size == (10, 8)
    assert main(["render", "cornell", "--integrator", "path", "--seed", "x", "--size", "8",
                 "-o", str(target)]) != 0
    assert "seed" in capsys.readouterr().err
