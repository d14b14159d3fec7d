"""Tests the viewer without a window: selections, the pace of drawing, and cameras."""
from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import VIEW, Clock
from PIL import Image
from windowless import METHODS, full, settle

from gpgpu_rt.cli import main
from gpgpu_rt.methods import find_method
from gpgpu_rt.scene.camera import Camera
from gpgpu_rt.viewer import Selection, Viewer, moves
from gpgpu_rt.viewer.drawn_camera import PIXEL_SHARE, fitted, rounded
from gpgpu_rt.viewer.overlay import projected
from gpgpu_rt.viewer.pace import DIVISORS, MOVING, PATIENCE, Pace
from gpgpu_rt.viewer.selection import camera_words, option_words

# Selection --------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", METHODS)
def test_every_option_of_the_table_can_be_chosen_and_written(method: str) -> None:
    selection = Selection("cornell").with_method(method)
    names = {option.name for option in selection.known()}
    assert names >= {option.name for option in find_method(method).options}
    assert names >= {"schedule", "steps_per_pass", "precision", "intersection"}
    for option in selection.known():
        for value in [*(option.choices or ()), *(() if option.choices else (option.default,))]:
            word, = option_words({option.name: value}, (option,))
            assert option.parse(word.partition("=")[2]) == value
    schedules = next(o.choices for o in selection.known() if o.name == "schedule")
    assert schedules == find_method(method).schedules_for({})


def test_options_are_carried_over_where_the_other_method_has_them() -> None:
    selection = Selection("cornell", "kd-restart").with_option("schedule", "step")
    selection = selection.with_option("interval", "strict").with_option("steps_per_pass", 4)
    assert selection.with_method("kd-backtrack").options == selection.options
    assert selection.with_method("kd-texture-stack").options["schedule"] == "step"
    for method in ("kd-texture-stack", "kd-packet"):
        assert "steps_per_pass" not in selection.with_method(method).options
    assert selection.with_method("kd-stack").options.get("schedule") is None
    assert "interval" not in selection.with_method("grid").options
    assert selection.with_option("interval", "exact").options.get("interval") is None


@pytest.mark.parametrize("method, options, integrator, light", [
    ("bvh-threaded", {}, "whitted", {}),
    full("kd-restart", {"schedule": "step", "steps_per_pass": 3, "storage": "fp16"}, "direct", {}),
    full("grid", {"resolution": (3, 4, 5), "intersection": "plucker"}, "whitted", {"bounces": 1}),
    full("bvh-packet", {"packet": (4, 2)}, "path", {"samples": 2}),
])
def test_the_command_draws_the_same_pixels(soup: str, clock: Clock, tmp_path: Path, method: str,
                                           options: dict, integrator: str, light: dict) -> None:
    viewer = Viewer(Selection(soup, method, options, integrator, light), VIEW, clock=clock)
    viewer.camera = moves.fly(moves.orbit(viewer.camera, 0.37, -0.21), 0.01, -0.02, 0.1)
    settle(viewer)
    assert viewer.divisor == 1 and not viewer.message
    words = shlex.split(viewer.command)
    assert words[0] == "gpgpu-rt"
    output = tmp_path / "again.png"
    assert main([*words[1:-1], f"--output={output}"]) == 0
    assert (np.asarray(Image.open(output)) == viewer.image).all()
    assert len(np.unique(viewer.image.reshape(-1, 3), axis=0)) > 20  # the picture is not empty
    viewer.release()


def test_a_camera_survives_the_command_line_to_the_bit() -> None:
    camera = Camera((-1 / 3, 1e-9, 2e5), (0.1, -0.2, 1 / 7), (0.1, 1.0, -0.3), 33.3)
    words = dict(word[2:].split("=") for word in camera_words(camera))
    vectors = {name: tuple(map(float, words[name].split(","))) for name in
               ("eye", "target", "up")}
    assert Camera(**vectors, fov=float(words["fov"])) == camera


@pytest.mark.parametrize("scale", [1e-3, 1.0, 3e4])
def test_the_command_has_the_fewest_digits_for_its_rays(viewer: Viewer, scale: float) -> None:
    """The drawn camera has short numbers. Its rays differ from the exact camera's rays by less
    than PIXEL_SHARE of a pixel. With one decimal less in the target, the difference would be more
    than half of PIXEL_SHARE."""
    rng, size = np.random.default_rng(7), (640, 480)
    target = scale * rng.normal(size=3)
    exact = Camera(tuple(target + scale * rng.normal(size=3)), tuple(target), fov=37.123456789)
    drawn = rounded(exact, size)
    origins, directions = exact.rays(size)
    ahead = directions @ exact.basis(size)[2]
    distance = np.linalg.norm(np.subtract(exact.target, exact.eye))
    pixels = np.stack(np.meshgrid(*(np.arange(side) + 0.5 for side in size)), -1)

    def most(camera: Camera) -> float:
        """Returns the largest shift of a pixel of the exact picture, in pixels."""
        found = [0.0]
        for part in (0.25, 1.0):
            points = exact.eye + directions * (part * distance / ahead)[..., None]
            at = projected(camera, size, np.stack([points, points], axis=-2).reshape(-1, 2, 3))
            found.append(np.abs(at[:, 0].reshape(pixels.shape) - pixels).max())
        return max(found)

    assert most(drawn) < PIXEL_SHARE + 1e-3     # 1e-3, because rays are rounded to float32
    words = camera_words(drawn)
    assert max(len(number.split(".")[-1]) for number in words[0][6:].split(",")) <= 9
    assert len(" ".join(words)) < 0.7 * len(" ".join(camera_words(exact)))
    decimals = max(len(f"{part:.12f}".rstrip("0").split(".")[1]) for part in drawn.target)
    if decimals:
        coarser = replace(drawn, target=tuple(round(part, decimals - 1) for part in exact.target))
        assert most(coarser) > PIXEL_SHARE / 2


def test_the_command_leaves_out_the_scene_s_own_camera(viewer: Viewer) -> None:
    settle(viewer)
    own = viewer.scene.camera
    assert viewer.view == own and "--eye" not in viewer.command and "--fov" not in viewer.command
    viewer.resize((30, 90))      # narrower than high: only the field of view changes
    assert "--fov=" in viewer.command and "--eye" not in viewer.command
    viewer.camera = replace(own, eye=(1.0, 2.0, 3.0))
    assert "--eye=1,2,3 " in viewer.command and "--target" not in viewer.command


def test_a_narrow_picture_shows_what_a_square_shows() -> None:
    camera = Camera((1.0, 2.0, 5.0), (0.2, -0.3, 0.1), fov=50)
    assert fitted(camera, (80, 80)) == fitted(camera, (90, 80)) == camera
    edge = camera.rays((9, 9))[1][4, 0]      # the middle of the left edge of a square picture
    points = np.array([[camera.eye, camera.eye + 3 * edge]])
    (x, y), = projected(fitted(camera, (45, 90)), (45, 90), points)[:, 1]
    assert np.isclose(x, 2.5, atol=1e-3) and np.isclose(y, 45, atol=1e-3)


# Pace -------------------------------------------------------------------------------------------

@pytest.mark.parametrize("pixel_seconds", [1e-8, 1e-6, 1e-4])
def test_the_pace_keeps_to_its_limits(clock: Clock, pixel_seconds: float) -> None:
    """While the camera moves, drawing keeps to the time limit MOVING, unless even the coarsest
    picture takes longer. At rest, drawing keeps to PATIENCE."""
    pace, pixels = Pace(clock), 640 * 480

    def take(divisor: int) -> float:
        seconds = 0.002 + pixel_seconds * pixels / divisor ** 2
        pace.measured(divisor, seconds)
        clock.now += seconds
        return seconds

    take(pace.moving())
    moving = [take(pace.moving()) for _ in range(6)]
    coarsest = 0.002 + pixel_seconds * pixels / DIVISORS[-1] ** 2
    assert max(moving) <= max(MOVING, coarsest)
    shown = None
    waited = []
    while (divisor := pace.resting(shown)) is not None:
        assert shown is None or divisor < shown
        shown = divisor
        waited.append(take(divisor))
    assert max(waited) <= 1.01 * PATIENCE
    assert (shown == 1) == (0.002 + pixel_seconds * pixels <= PATIENCE)


def test_a_slow_picture_is_drawn_only_on_request(viewer: Viewer, clock: Clock,
                                                 monkeypatch) -> None:
    """A full picture that would take longer than PATIENCE is drawn only after `insist`."""
    draw = viewer.tracer.render

    def slow(camera, size, *more, **options):
        clock.now += 0.01 * size[0] * size[1]  # 17 s for all pixels
        return draw(camera, size, *more, **options)

    monkeypatch.setattr(viewer.tracer, "render", slow)
    settle(viewer)
    assert viewer.divisor > 1 and viewer.held_back > PATIENCE
    viewer.insist()
    assert viewer.step() and viewer.divisor == 1 and viewer.held_back is None
    assert viewer.image.shape == (VIEW[1], VIEW[0], 3)


def test_moving_is_coarse_and_rest_is_fine(viewer: Viewer, clock: Clock) -> None:
    settle(viewer)
    fine = viewer.image
    assert fine.shape[:2] == VIEW[::-1]
    viewer.pace.measured(1, 1.0)  # as if a full picture took a second
    viewer.camera = moves.orbit(viewer.camera, 0.1, 0.0)
    assert viewer.step() and viewer.image.shape[0] < VIEW[1] / 2
    assert not viewer.step(), "drawn again although nothing moved"
    viewer.camera = moves.orbit(viewer.camera, -0.1, 0.0)
    viewer.reset_camera()
    settle(viewer)
    assert (viewer.image == fine).all() and viewer.settled_after >= 0
    viewer.resize((0, 0))  # minimised
    viewer.resize((VIEW[0] + 7, VIEW[1] + 3))
    settle(viewer)
    assert viewer.image.shape[:2] == (VIEW[1] + 3, VIEW[0] + 7)


# Cameras ----------------------------------------------------------------------------------------

@pytest.mark.parametrize("seed", [1, 2])
def test_moves(seed: int) -> None:
    """An orbit keeps the target and its distance from the eye. A look keeps the eye. A flight
    there and back keeps the eye and the target."""
    rng = np.random.default_rng(seed)
    camera = Camera(tuple(rng.normal(size=3)), tuple(rng.normal(size=3)))
    distance = np.linalg.norm(np.subtract(camera.target, camera.eye))
    turned = moves.orbit(camera, 0.4, 0.3)
    assert turned.target == camera.target
    assert np.isclose(np.linalg.norm(np.subtract(turned.target, turned.eye)), distance)
    steep = moves.orbit(camera, 0.0, 9.0)
    assert abs(np.subtract(steep.target, steep.eye) @ camera.up) < distance
    seen = moves.look(camera, 0.4, -0.3)
    assert seen.eye == camera.eye and seen.target != camera.target
    back = moves.fly(moves.fly(camera, 1, 2, 3), -1, -2, -3)
    assert np.allclose(back.eye, camera.eye) and np.allclose(back.target, camera.target)
    near = moves.approach(camera, 0.5)
    assert np.isclose(np.linalg.norm(np.subtract(near.target, near.eye)), distance / 2)
    # A pan by the image's height of 100 pixels moves the target from y = 50 to y = 150.
    up = moves.pan(camera, 0.0, 1.0)
    (x, y), = projected(up, (200, 100), np.array([[camera.target, camera.target]]))[:, 0]
    assert np.isclose(x, 100) and np.isclose(y, 150)


def test_projected_points_lie_on_their_pixels() -> None:
    camera = Camera((1.0, 2.0, 5.0), (0.2, -0.3, 0.1), fov=50)
    origins, directions = camera.rays((40, 30))
    points = origins + 3.7 * directions
    found = projected(camera, (40, 30), np.stack([points, points], axis=-2))
    x, y = np.meshgrid(np.arange(40) + 0.5, np.arange(30) + 0.5)
    assert np.allclose(found[:, 0], np.stack([x.ravel(), y.ravel()], 1), atol=1e-3)
    behind = np.array([[camera.eye - 2 * directions[0, 0], camera.eye - directions[0, 0]]])
    assert len(projected(camera, (40, 30), behind)) == 0
    through = np.array([[camera.eye - directions[15, 20], points[15, 20]]])
    assert np.isfinite(projected(camera, (40, 30), through)).all()
