"""The viewer without a window: choices, paces, moves, what is shown, and what goes wrong."""
from __future__ import annotations

import json
import shlex
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from conftest import random_soup
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt import false_colours as colours
from gpgpu_rt.camera import Camera
from gpgpu_rt.cli import main
from gpgpu_rt.methods import _TABLE, find_method, register
from gpgpu_rt.ray_state import RayBatch
from gpgpu_rt.shader import ROOT
from gpgpu_rt.time_travel import decode
from gpgpu_rt.viewer import Choices, Viewer, moves
from gpgpu_rt.viewer.choices import camera_words, option_words
from gpgpu_rt.viewer.journey import Journey
from gpgpu_rt.viewer.overlay import projected
from gpgpu_rt.viewer.pace import DIVISORS, MOVING, PATIENCE, Pace
from gpgpu_rt.viewer.ray_path import follow
from gpgpu_rt.viewer.tracers import KEPT


def full(*values: object):
    return pytest.param(*values, marks=pytest.mark.full)


METHODS = [row.name for row in rt.methods()]
SIZE = (48, 36)


class Clock:
    """Time that passes when it is told to."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def soup(tmp_path: Path) -> str:
    corners = random_soup(60, seed=5).reshape(-1, 3)
    path = tmp_path / "soup.ply"
    trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False).export(path)
    return str(path)


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def viewer(soup: str, clock: Clock) -> Iterator[Viewer]:
    one = Viewer(Choices(soup), SIZE, clock=clock)
    yield one
    one.release()


def settle(viewer: Viewer, steps: int = 30) -> None:
    """Let it rest until there is nothing more to do."""
    viewer.clock.now += 1.0
    for _ in range(steps):
        viewer.step()
        if viewer.finished:
            return
    raise AssertionError(f"not finished after {steps} steps: {viewer.message}")


# Choices ----------------------------------------------------------------------------------------

@pytest.mark.parametrize("method", METHODS)
def test_every_option_of_the_table_can_be_chosen_and_written(method: str) -> None:
    choices = Choices("cornell").with_method(method)
    names = {option.name for option in choices.known()}
    assert names >= {option.name for option in find_method(method).options}
    assert names >= {"schedule", "steps_per_pass", "precision", "intersection"}
    for option in choices.known():
        for value in [*(option.choices or ()), *(() if option.choices else (option.default,))]:
            word, = option_words({option.name: value}, (option,))
            assert option.parse(word.partition("=")[2]) == value
    schedules = next(o.choices for o in choices.known() if o.name == "schedule")
    assert schedules == find_method(method).schedules_for({})


def test_options_are_carried_over_where_the_other_method_has_them() -> None:
    choices = Choices("cornell", "kd-restart").with_option("schedule", "step")
    choices = choices.with_option("interval", "strict").with_option("steps_per_pass", 4)
    assert choices.with_method("kd-backtrack").options == choices.options
    assert choices.with_method("kd-texture-stack").options["schedule"] == "step"
    assert "steps_per_pass" not in choices.with_method("kd-texture-stack").options
    assert choices.with_method("kd-stack").options.get("schedule") is None
    assert "interval" not in choices.with_method("grid").options
    assert choices.with_option("interval", "exact").options.get("interval") is None


@pytest.mark.parametrize("method, options, integrator, light", [
    ("bvh-threaded", {}, "whitted", {}),
    full("kd-restart", {"schedule": "step", "steps_per_pass": 3, "storage": "fp16"}, "direct", {}),
    full("grid", {"resolution": (3, 4, 5), "intersection": "plucker"}, "whitted", {"bounces": 1}),
    full("bvh-packet", {"packet": (4, 2)}, "path", {"samples": 2}),
])
def test_the_line_draws_the_same_pixels(soup: str, clock: Clock, tmp_path: Path, method: str,
                                        options: dict, integrator: str, light: dict) -> None:
    viewer = Viewer(Choices(soup, method, options, integrator, light), SIZE, clock=clock)
    viewer.camera = moves.fly(moves.orbit(viewer.camera, 0.37, -0.21), 0.01, -0.02, 0.1)
    settle(viewer)
    assert viewer.divisor == 1 and not viewer.message
    words = shlex.split(viewer.command)
    assert words[0] == "gpgpu-rt"
    output = tmp_path / "again.png"
    assert main([*words[1:-1], f"--output={output}"]) == 0
    assert (np.asarray(Image.open(output)) == viewer.image).all()
    assert len(np.unique(viewer.image.reshape(-1, 3), axis=0)) > 20    # something is there
    viewer.release()


def test_a_camera_survives_the_command_line_to_the_bit() -> None:
    camera = Camera((-1 / 3, 1e-9, 2e5), (0.1, -0.2, 1 / 7), (0.1, 1.0, -0.3), 33.3)
    words = dict(word[2:].split("=") for word in camera_words(camera))
    vectors = {name: tuple(map(float, words[name].split(","))) for name in
               ("eye", "target", "up")}
    assert Camera(**vectors, fov=float(words["fov"])) == camera


# Pace -------------------------------------------------------------------------------------------

@pytest.mark.parametrize("pixel_seconds", [1e-8, 1e-6, 1e-4])
def test_the_pace_keeps_to_its_limits(clock: Clock, pixel_seconds: float) -> None:
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


def test_what_takes_too_long_waits_to_be_asked_for(viewer: Viewer, clock: Clock,
                                                   monkeypatch) -> None:
    draw = viewer.tracer.render

    def slow(camera, size, *more, **options):
        clock.now += 0.01 * size[0] * size[1]       # 17 s for all pixels
        return draw(camera, size, *more, **options)

    monkeypatch.setattr(viewer.tracer, "render", slow)
    settle(viewer)
    assert viewer.divisor > 1 and viewer.held_back > PATIENCE
    viewer.insist()
    assert viewer.step() and viewer.divisor == 1 and viewer.held_back is None
    assert viewer.image.shape == (SIZE[1], SIZE[0], 3)


def test_moving_is_coarse_and_rest_is_fine(viewer: Viewer, clock: Clock) -> None:
    settle(viewer)
    fine = viewer.image
    assert fine.shape[:2] == SIZE[::-1]
    viewer.pace.measured(1, 1.0)     # as if a full picture took a second
    viewer.camera = moves.orbit(viewer.camera, 0.1, 0.0)
    assert viewer.step() and viewer.image.shape[0] < SIZE[1] / 2
    assert not viewer.step(), "nothing moved since"
    viewer.camera = moves.orbit(viewer.camera, -0.1, 0.0)
    viewer.reset_camera()
    settle(viewer)
    assert (viewer.image == fine).all() and viewer.settled_after >= 0
    viewer.resize((0, 0))       # minimised
    viewer.resize((SIZE[0] + 7, SIZE[1] + 3))
    settle(viewer)
    assert viewer.image.shape[:2] == (SIZE[1] + 3, SIZE[0] + 7)


# What goes wrong --------------------------------------------------------------------------------

@pytest.fixture
def user_method(tmp_path: Path) -> Iterator[str]:
    """A method of a user's whose shader has an error."""
    row = find_method("bvh-threaded")
    broken = tmp_path / "broken.glsl"
    text = (ROOT / str(row.glsl)).read_text()
    broken.write_text(text.replace("void init", "void oops(", 1) + "\nthis is no GLSL\n")
    register(replace(row, name="users-own", glsl=broken))
    yield "users-own"
    del _TABLE["users-own"]


def test_errors_are_said_and_the_picture_stays(viewer: Viewer, user_method: str,
                                               tmp_path: Path) -> None:
    settle(viewer)
    before, image = viewer.choices, viewer.image
    torn = tmp_path / "torn.obj"
    torn.write_text("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n")
    empty = tmp_path / "empty.obj"
    empty.write_text("")
    noise = tmp_path / "noise.ply"
    noise.write_bytes(bytes(range(256)))
    tries = [lambda: viewer.open(tmp_path / "missing.ply"), lambda: viewer.open(torn),
             lambda: viewer.open(empty), lambda: viewer.open(noise),
             lambda: viewer.choose(viewer.choices.with_method(user_method)),
             lambda: viewer.choose(replace(viewer.choices, method="geometry-image",
                                           options={"level": 10 ** 6}))]
    for number, attempt in enumerate(tries):
        attempt()
        assert viewer.busy and not viewer.step(), "a window says first what comes"
        viewer.step()
        assert viewer.message and "\n" not in viewer.message, number
        assert viewer.choices == before and viewer.image is image, viewer.message
        viewer.camera = moves.orbit(viewer.camera, 0.2, 0.0)
        assert viewer.step(), "it goes on"
        viewer.reset_camera()
        settle(viewer)
        assert (viewer.image == image).all()
        image = viewer.image
    assert viewer.gpu.context.error == "GL_NO_ERROR"


def test_an_error_while_drawing_is_not_tried_again_and_again(viewer: Viewer,
                                                             monkeypatch) -> None:
    calls = []

    def fail(*given, **options):
        calls.append(given)
        raise RuntimeError("lost\nthe device")

    monkeypatch.setattr(viewer.tracer, "render", fail)
    viewer.clock.now += 1
    for _ in range(5):
        viewer.step()
    assert len(calls) == 1 and viewer.message == "RuntimeError: lost the device"


def test_a_row_alone_makes_a_method_appear(viewer: Viewer) -> None:
    settle(viewer)
    register(replace(find_method("grid"), name="users-grid"))
    try:
        viewer.choose(viewer.choices.with_method("users-grid"))
        settle(viewer)
        assert viewer.choices.method == "users-grid" == viewer.tracer.method.name
        assert "--method=users-grid" in viewer.command and not viewer.message
    finally:
        del _TABLE["users-grid"]


# Modes ------------------------------------------------------------------------------------------

def test_the_picture_s_tracer_outlives_those_of_other_modes(viewer: Viewer) -> None:
    settle(viewer)
    image = viewer.image
    viewer.look_at("heat")
    settle(viewer)
    viewer.change_heat(other="grid")
    settle(viewer)
    viewer.follow((5, 5))
    settle(viewer)
    viewer.look_at("picture")
    settle(viewer)
    assert not viewer.message and (viewer.image == image).all()
    assert len(viewer.tracers._tracers) == KEPT


def test_graphs_show_what_heat_maps_cost(viewer: Viewer) -> None:
    """Under passes, both methods go through some; the picture's own schedule has one."""
    viewer.look_at("heat")
    viewer.change_heat(what="passes", other="grid")
    settle(viewer)
    assert viewer.last.rays == 2 * SIZE[0] * SIZE[1]
    most = [int(one.values.max()) for one in viewer.heat.maps]
    assert viewer.last.passes >= sum(most) and max(viewer.last.live) <= SIZE[0] * SIZE[1]
    assert len(viewer.last.live) > 2


def test_heat_of_two_methods_has_one_scale(viewer: Viewer) -> None:
    viewer.look_at("heat")
    viewer.change_heat(what="triangles", other="brute-force")
    settle(viewer)
    one, two = viewer.heat.maps
    with rt.Tracer(viewer.scene, "bvh-threaded", statistics=True) as tracer:
        hits = tracer.trace(*viewer.camera.rays(SIZE))
    assert (one.values.ravel() == hits.triangles_tested).all()
    for wipe, map_shown in ((0.0, two), (1.0, one)):    # where the other one begins
        viewer.change_heat(wipe=wipe)
        assert (viewer.image == colours.ramp(map_shown.values / viewer.heat.top)).all()
    assert (one.values != two.values).any()
    viewer.change_heat(layout="side by side")
    settle(viewer)
    assert viewer.image.shape[:2] == SIZE[::-1]
    assert viewer.heat.maps[0].values.shape == (SIZE[1], SIZE[0] // 2)


@pytest.mark.parametrize("method", ["bvh-threaded", *map(full, ("kd-restart", "grid",
                                                                "bvh-packet"))])
def test_a_journey_ends_at_the_hits_of_a_trace(soup: str, method: str) -> None:
    scene = rt.load_scene(soup)
    rays = scene.camera.rays(SIZE)
    with rt.Tracer(scene, method, schedule="step") as tracer:
        hits = tracer.trace(*rays)
        whole = Journey(tracer, scene.camera, SIZE)
        thin = Journey(tracer, scene.camera, SIZE, most_bytes=whole._bytes // 3)
        cut = Journey(tracer, scene.camera, SIZE, clock=iter(range(10 ** 6)).__next__, seconds=4)
    last = decode(RayBatch(*rays, bounds=scene.bounds), whole.kept[-1])
    assert (last.triangle == hits.triangle).all() and (last.t == hits.t).all()
    assert whole.every == 1 and not whole.note and whole.live[-1] == 0 < whole.live[0]
    assert thin.every > 1 and all(one.number % thin.every == 0 for one in thin.kept)
    assert (thin.live == whole.live).all()
    assert "stopped" in cut.note and len(cut.kept) < len(whole.kept)
    for field in whole.fields:
        for index in (0, len(whole.kept) - 1):
            pixels = whole.pixels(index, field)
            assert pixels.shape == (SIZE[1], SIZE[0], 3) and pixels.dtype == np.uint8
    ray = 7 * SIZE[0] + 11
    words = dict(whole.state_of(len(whole.kept) // 2, ray))
    one = whole.kept[len(whole.kept) // 2]
    assert words["steps"] == str(one.state["steps"][ray])


@pytest.mark.full
def test_scrubbing_shows_each_pass(viewer: Viewer) -> None:
    viewer.look_at("passes")
    settle(viewer)
    first = viewer.image
    viewer.go_to(len(viewer.journey.kept) // 2)
    assert (viewer.image != first).any()
    viewer.go_to(10 ** 9)
    assert viewer.index == len(viewer.journey.kept) - 1
    assert dict(viewer.ray_of((5, 5)))["phase"].endswith("(done)")
    viewer.choose(viewer.choices.with_method("kd-stack"))    # all of it in one pass
    for _ in range(4):
        viewer.step()
    assert "one pass" in viewer.message and viewer.journey is None
    viewer.look_at("picture")
    settle(viewer)
    assert viewer.divisor == 1


@pytest.mark.parametrize("method", ["bvh-threaded", full("kd-restart"), full("grid")])
def test_a_clicked_ray_goes_through_its_boxes_to_its_hit(soup: str, method: str) -> None:
    scene = rt.load_scene(soup)
    rays = scene.camera.rays(SIZE)
    with rt.Tracer(scene, method, schedule="step") as tracer:
        hits = tracer.trace(*rays)
        pixel = int(np.flatnonzero(hits.hit)[len(hits.t[hits.hit]) // 2])
        x, y = pixel % SIZE[0], pixel // SIZE[0]
        path = follow(tracer, scene.camera, SIZE, (x, y))
    assert path.hit == hits.triangle[pixel]
    assert path.rows[-1][-1] == str(path.hit) and path.rows[-1][2] == "done"
    assert len(path.columns) == len(path.rows[0]) and len(path.boxes) > 2
    # Boxes that hold rays' intervals are boxes that the ray meets.
    way = path.end - path.origin
    lo, hi = path.boxes[:, 0], path.boxes[:, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (lo - path.origin) / way, (hi - path.origin) / way
    enter, leave = np.minimum(a, b).max(1), np.maximum(a, b).min(1)
    met = enter <= leave + 1e-4
    # A threaded walk also looks into boxes that it then passes by.
    assert met.mean() > (0.3 if method == "bvh-threaded" else 0.99)
    assert path.edges().shape == (len(path.boxes), 12, 2, 3)
    lengths = np.abs(path.edges()[:, :, 1] - path.edges()[:, :, 0])
    assert np.allclose(lengths.sum(axis=(1, 2)), 4 * (hi - lo).sum(axis=1))


def test_a_click_is_followed_and_survives_a_move(viewer: Viewer) -> None:
    settle(viewer)
    viewer.follow((10 ** 6, -5))    # outside: the nearest pixel
    assert viewer.busy and not viewer.finished
    settle(viewer)
    assert viewer.path.pixel == (SIZE[0] - 1, 0) and not viewer.message
    viewer.camera = moves.orbit(viewer.camera, 0.3, 0.0)
    settle(viewer)
    assert viewer.path is not None, "to be seen from elsewhere"
    viewer.choose(viewer.choices.with_option("octants", True))
    settle(viewer)
    assert viewer.path is None


# Cameras ----------------------------------------------------------------------------------------

@pytest.mark.parametrize("seed", [1, 2])
def test_moves(seed: int) -> None:
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
    # A pan by the image's height brings what was at its lower edge to the upper one.
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


# Saving -----------------------------------------------------------------------------------------

def test_a_picture_is_saved_with_its_settings(viewer: Viewer, tmp_path: Path) -> None:
    viewer.camera = moves.orbit(viewer.camera, 0.3, 0.1)
    viewer.step()
    first, second = viewer.save(tmp_path), viewer.save(tmp_path)
    assert first != second and viewer.message.endswith(second.name)
    with Image.open(first) as image:
        assert image.size == SIZE
        held = json.loads(image.text["gpgpu-rt"])
        pixels = np.asarray(image)
    assert held == json.loads(first.with_suffix(".json").read_text())
    assert held["camera"] == viewer.camera.to_dict() and held["method"] == "bvh-threaded"
    again = tmp_path / "again.png"
    assert main([*shlex.split(held["command"])[1:-1], f"--output={again}"]) == 0
    assert (np.asarray(Image.open(again)) == pixels).all()
    assert viewer.save(tmp_path / "nowhere") is None and "no folder" in viewer.message


@pytest.mark.parametrize("what, other, layout", [
    ("triangles", "brute-force", "side by side"), full("passes", "grid", "wipe")])
def test_a_heat_map_is_saved_whole_with_what_it_follows_from(
        viewer: Viewer, tmp_path: Path, capsys, what: str, other: str, layout: str) -> None:
    viewer.look_at("heat")
    viewer.change_heat(what=what, other=other, layout=layout, wipe=0.3)
    viewer.pace.measured(1, 1.0)        # as if a full picture took a second
    viewer.step()
    assert viewer.divisor > 1
    path = viewer.save(tmp_path)
    with Image.open(path) as image:
        pixels, held = np.asarray(image), json.loads(image.text["gpgpu-rt"])
    assert viewer.divisor == 1 and viewer.image.shape[:2] == SIZE[::-1]
    assert (pixels[:SIZE[1], :SIZE[0]] == viewer.image).all()
    assert {name: held["heat"][name] for name in ("what", "other", "layout", "wipe")} == {
        "what": what, "other": other, "layout": layout, "wipe": 0.3}
    assert [one["method"] for one in held["heat"]["maps"]] == ["bvh-threaded", other]
    words = shlex.split(held["command"])
    assert words[:2] == ["gpgpu-rt", "heat"]
    capsys.readouterr()
    assert main([*words[1:-1], f"--output={tmp_path / 'again.png'}", "--json"]) == 0
    again = json.loads(capsys.readouterr().out)["methods"]
    for one, row in zip(viewer.heat.maps, again, strict=True):
        assert row["map"] == one.title and one.summary().items() <= row.items()
    viewer.camera = moves.orbit(viewer.camera, 0.3, 0.1)
    assert viewer.settings()["command"] is None and "no command" in viewer.command


def test_passes_are_saved_with_what_they_follow_from(viewer: Viewer, tmp_path: Path) -> None:
    viewer.look_at("passes")
    viewer.step()       # the camera does not rest yet: a coarse picture
    assert viewer.journey is None
    path = viewer.save(tmp_path)
    viewer.go_to(3, "node")
    path = viewer.save(tmp_path)
    held = json.loads(path.with_suffix(".json").read_text())
    assert held["passes"]["pass"] == 3 and held["passes"]["field"] == "node"
    assert held["passes"]["options"]["schedule"] == "step" and held["passes"]["size"] == [*SIZE]
    with Image.open(path) as image:
        assert (np.asarray(image) == viewer.journey.pixels(3, "node")).all()
    words = shlex.split(held["command"])
    assert main([*words[1:-1], f"--output={tmp_path / 'again'}", "--every=1000"]) == 0
    again = json.loads((tmp_path / "again" / "passes.json").read_text())["passes"]
    assert [one["live"] for one in again] == viewer.journey.live.tolist()
    viewer.camera = moves.orbit(viewer.camera, 0.3, 0.1)
    assert "no command" in viewer.command


def test_without_a_display_one_line_says_so(monkeypatch, capsys) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert main(["view", "cornell"]) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and ("no window" in said or "gpgpu_rt[view]" in said)


@pytest.mark.parametrize("words, said", [
    (["view", "cornell", "-m", "kd-restrat"], "did you mean"),
    (["view", "cornell", "--statistics=true"], "decides about statistics"),
    (["view", "cornell", "-m", "auto"], "method's name"),
    (["view", "cornell", "--folder", "/nowhere/at/all"], "no such folder"),
    (["view", "cornell", "--octants", "-m", "grid"], "no option --octants"),
])
def test_mistakes_are_one_line(words: list[str], said: str, capsys) -> None:
    assert main(words) == 1
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
