"""Tests the viewer without a window: each mode shows the right content, and saved files hold this
content."""
from __future__ import annotations

import json
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import VIEW
from PIL import Image
from windowless import full, settle

import gpgpu_rt as rt
from gpgpu_rt.cli import main
from gpgpu_rt.inspect import false_colours as colours
from gpgpu_rt.inspect.heat import KINDS, Heat, draw_heat
from gpgpu_rt.inspect.time_travel import decode
from gpgpu_rt.methods import built_in_methods
from gpgpu_rt.rays.batch import RayBatch
from gpgpu_rt.viewer import Viewer, heat_view, moves, ray_path
from gpgpu_rt.viewer.journey import Journey
from gpgpu_rt.viewer.ray_path import follow
from gpgpu_rt.viewer.tracers import KEPT

# Modes ------------------------------------------------------------------------------------------


def test_the_tracer_of_the_picture_is_kept_in_other_modes(viewer: Viewer) -> None:
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


def test_graphs_show_the_cost_of_heat_maps(viewer: Viewer) -> None:
    """In heat mode, the graphs count the passes and rays of both heat maps. A heat map takes
    several passes here, whereas the ordinary picture's schedule takes one pass."""
    viewer.look_at("heat")
    viewer.change_heat(what="passes", other="grid")
    settle(viewer)
    assert viewer.last.rays == 2 * VIEW[0] * VIEW[1]
    most = [int(one.values.max()) for one in viewer.heat.maps]
    assert viewer.last.passes >= sum(most) and max(viewer.last.live) <= VIEW[0] * VIEW[1]
    assert len(viewer.last.live) > 2


def test_the_time_to_make_a_tracer_delays_no_heat_map(viewer: Viewer, monkeypatch) -> None:
    """The time to make a tracer does not count when the viewer decides how fine a map is drawn."""
    make, count = viewer.tracers.get, heat_view.heat

    def slow(*given, **options):
        before = viewer.tracers.made
        tracer = make(*given, **options)
        viewer.clock.now += 100.0 * (viewer.tracers.made - before)
        return tracer

    def slow_at_first(*given):  # the first map compiles its programs
        viewer.clock.now += 0.0 if viewer.heat.maps else 100.0
        return count(*given)

    monkeypatch.setattr(viewer.tracers, "get", slow)
    monkeypatch.setattr(heat_view, "heat", slow_at_first)
    viewer.look_at("heat")
    settle(viewer)
    assert viewer.divisor == 1 and viewer.held_back is None


def test_heat_of_two_methods_has_one_scale(viewer: Viewer) -> None:
    viewer.look_at("heat")
    viewer.change_heat(what="triangles", other="brute-force")
    settle(viewer)
    one, two = viewer.heat.maps
    with rt.Tracer(viewer.scene, "bvh-threaded", statistics=True) as tracer:
        hits = tracer.trace(*viewer.camera.rays(VIEW))
    assert (one.values.ravel() == hits.triangles_tested).all()
    for wipe, map_shown in ((0.0, two), (1.0, one)):  # wipe: the share of the picture for map one
        viewer.change_heat(wipe=wipe)
        assert (viewer.image == colours.ramp(map_shown.values / viewer.heat.top)).all()
    assert (one.values != two.values).any()
    viewer.change_heat(layout="side by side")
    settle(viewer)
    assert viewer.image.shape[:2] == VIEW[::-1]
    assert viewer.heat.maps[0].values.shape == (VIEW[1], VIEW[0] // 2)


@pytest.mark.parametrize("what", KINDS)
def test_a_scale_says_whether_rays_lie_beyond(monkeypatch, what: str) -> None:
    """The panel, a saved map and the `heat` command draw the same scale. The scale says whether
    any ray costs more than the value at the scale's end."""
    bars, draw = [], colours.colour_bar

    def noted(highest, unit, width, lowest=0.0, beyond=False):
        bars.append((highest, unit, beyond))
        return draw(highest, unit, width, lowest, beyond)

    monkeypatch.setattr(colours, "colour_bar", noted)
    values = np.ones((20, 30), int)
    for most, beyond in ((1, False), (248, True)):
        values[3, 4] = most
        view = heat_view.HeatView(what, maps=(Heat("grid", values),), top=1.0)
        view.with_scale(Image.fromarray(view.pixels()))
        view.scale(250)
        draw_heat(view.maps, what, "soup")
        assert bars == 3 * [(1.0, KINDS[what], beyond)]
        bars.clear()
    assert KINDS[what].count(" ray") == 1


@pytest.mark.parametrize("method", ["bvh-threaded", *map(full, ("kd-restart", "grid",
                                                                "bvh-packet"))])
def test_a_journey_ends_at_the_hits_of_a_trace(soup: str, method: str) -> None:
    """The last recorded pass has the hits of a trace. A limit of memory keeps only every n-th
    pass, and a limit of time stops the recording."""
    scene = rt.load_scene(soup)
    rays = scene.camera.rays(VIEW)
    with rt.Tracer(scene, method, schedule="step") as tracer:
        hits = tracer.trace(*rays)
        whole = Journey(tracer, scene.camera, VIEW)
        thin = Journey(tracer, scene.camera, VIEW, most_bytes=whole._bytes // 3)
        cut = Journey(tracer, scene.camera, VIEW, clock=iter(range(10 ** 6)).__next__, seconds=4)
    last = decode(RayBatch(*rays, bounds=scene.bounds), whole.kept[-1])
    assert (last.triangle == hits.triangle).all() and (last.t == hits.t).all()
    assert whole.every == 1 and not whole.note and whole.live[-1] == 0 < whole.live[0]
    assert thin.every > 1 and all(one.number % thin.every == 0 for one in thin.kept)
    assert (thin.live == whole.live).all()
    assert "stopped" in cut.note and len(cut.kept) < len(whole.kept)
    for field in whole.fields:
        for index in (0, len(whole.kept) - 1):
            pixels = whole.pixels(index, field)
            assert pixels.shape == (VIEW[1], VIEW[0], 3) and pixels.dtype == np.uint8
    ray = 7 * VIEW[0] + 11
    words = dict(whole.state_of(len(whole.kept) // 2, ray))
    one = whole.kept[len(whole.kept) // 2]
    assert words["steps"] == str(one.state["steps"][ray])


@pytest.mark.full
def test_scrubbing_shows_each_pass(viewer: Viewer) -> None:
    viewer.look_at("passes")
    settle(viewer)
    live = [one.live for one in viewer.journey.kept]
    assert 0.25 < live[viewer.index] / live[0] < 0.75, "too few or too many live rays"
    opened = viewer.image
    viewer.go_to(0)
    assert (viewer.image != opened).any()
    viewer.camera = moves.orbit(viewer.camera, 0.01, 0.0)
    settle(viewer)
    assert viewer.index == 0, "another camera changes the chosen pass"
    viewer.go_to(10 ** 9)
    assert viewer.index == len(viewer.journey.kept) - 1
    assert dict(viewer.ray_of((5, 5)))["phase"].endswith("(done)")
    viewer.look_at("picture")
    settle(viewer)
    assert viewer.divisor == 1


@pytest.mark.parametrize("method, why", [("kd-stack", "one pass"), ("ray-tiles", "no state")])
def test_a_method_without_passes_gives_a_reason(viewer: Viewer, method: str, why: str) -> None:
    """If the viewer cannot show the passes of a method, it gives the reason, and shows no passes
    of the previous method."""
    viewer.look_at("passes")
    settle(viewer)
    assert len(np.unique(viewer.image)) > 1
    viewer.choose(viewer.selection.with_method(method))
    settle(viewer)
    assert viewer.journey is None and why in viewer.failed and why in viewer.message
    assert len(np.unique(viewer.image.reshape(-1, 3), axis=0)) == 1
    assert why in viewer.command and not viewer.settings()["command"]
    viewer.choose(viewer.selection.with_method("grid"))
    settle(viewer)
    assert viewer.journey is not None and not viewer.failed
    assert len(np.unique(viewer.image)) > 1 and "gpgpu-rt passes" in viewer.command


def test_a_heat_map_that_fails_leaves_none_of_another_method(viewer: Viewer,
                                                             monkeypatch) -> None:
    viewer.look_at("heat")
    settle(viewer)

    def fail(*given):
        raise RuntimeError("lost the device")

    monkeypatch.setattr(heat_view, "heat", fail)
    viewer.choose(viewer.selection.with_method("grid"))
    settle(viewer)
    assert "lost the device" in viewer.failed and not viewer.heat.maps
    assert len(np.unique(viewer.image.reshape(-1, 3), axis=0)) == 1


def test_restarts_are_counted_for_methods_that_restart(viewer: Viewer) -> None:
    viewer.look_at("heat")
    viewer.change_heat(what="restarts")
    settle(viewer)
    assert "no count of restarts" in viewer.failed and not viewer.heat.maps
    viewer.choose(viewer.selection.with_method("kd-restart"))
    settle(viewer)
    assert not viewer.failed and viewer.heat.maps[0].values.max() > 0


def followed() -> list[tuple[str, dict]]:
    """Returns (method, options) for the built-in methods whose state names the box that a ray is
    in.

    Each method comes without options, and also with octants and with shared subtrees if it has
    these options.
    """
    tried = [(row, options) for row in built_in_methods() if "step" in row.schedules
             for options in ({}, {"octants": True}, {"octants": True, "shared_subtrees": 8})
             if set(options) <= {option.name for option in row.options}]
    return [(row.name, options) for row, options in tried if {"node:int", "cell:ivec3"} & set(
        (row.packet_state(options).state if row.packet_state else row.state).layout.split())]


@pytest.mark.parametrize("method, options", followed())
def test_a_clicked_ray_goes_through_its_boxes_to_its_hit(soup: str, method: str,
                                                         options: dict) -> None:
    scene = rt.load_scene(soup)
    rays = scene.camera.rays(VIEW)
    with rt.Tracer(scene, method, schedule="step", **options) as tracer:
        hits = tracer.trace(*rays)
        pixel = int(np.flatnonzero(hits.hit)[len(hits.t[hits.hit]) // 2])
        x, y = pixel % VIEW[0], pixel // VIEW[0]
        path = follow(tracer, scene.camera, VIEW, (x, y))
    assert path.hit == hits.triangle[pixel]
    assert path.rows[-1][-1] == str(path.hit) and path.rows[-1][2] == "done"
    assert len(path.columns) == len(path.rows[0]) and len(path.boxes) > 2
    # Almost all boxes of a walk down a tree or through a grid meet the ray.
    way = path.end - path.origin
    lo, hi = path.boxes[:, 0], path.boxes[:, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (lo - path.origin) / way, (hi - path.origin) / way
    enter, leave = np.minimum(a, b).max(1), np.maximum(a, b).min(1)
    met = enter <= leave + 1e-4
    # A walk along escape links also visits boxes that the ray misses.
    threaded = method in ("bvh-threaded", "geometry-image") or "octants" in options
    assert met.mean() > (0.3 if threaded else 0.99)
    assert path.edges().shape == (len(path.boxes), 12, 2, 3)
    lengths = np.abs(path.edges()[:, :, 1] - path.edges()[:, :, 0])
    assert np.allclose(lengths.sum(axis=(1, 2)), 4 * (hi - lo).sum(axis=1))


def test_a_click_is_followed_and_survives_a_move(viewer: Viewer) -> None:
    settle(viewer)
    viewer.follow((10 ** 6, -5))  # outside the picture: the nearest pixel is followed
    assert viewer.busy and not viewer.finished
    settle(viewer)
    assert viewer.path.pixel == (VIEW[0] - 1, 0) and not viewer.message
    viewer.camera = moves.orbit(viewer.camera, 0.3, 0.0)
    settle(viewer)
    assert viewer.path is not None, "a move of the camera drops the path"
    viewer.choose(viewer.selection.with_option("octants", True))
    settle(viewer)
    assert viewer.path is None


def test_a_field_without_a_value_shows_a_dash(soup: str) -> None:
    """Such fields are the hit of a ray that misses, and the postponed node in a packet's state."""
    scene = rt.load_scene(soup)
    away = replace(scene.camera, target=tuple(2 * np.array(scene.camera.eye)
                                              - scene.camera.target))
    for method in ("grid", "bvh-packet"):
        with rt.Tracer(scene, method, schedule="step") as tracer:
            journey = Journey(tracer, away, VIEW)
            words = [dict(journey.state_of(index, 0)) for index in range(len(journey.kept))]
            path = follow(tracer, away, VIEW, (0, 0))
        assert words[-1]["hit t"] == words[-1]["hit triangle"] == "-"
        assert path.rows[-1][-2:] == ("-", "-") and path.hit == -1
        assert not {"inf", str(1 << 24)} & {text for row in words for text in row.values()}


def test_a_path_that_is_cut_says_so(viewer: Viewer, monkeypatch) -> None:
    """A path of more than MOST_ROWS passes is cut, and its title says so."""
    viewer.follow((VIEW[0] // 2, VIEW[1] // 2))
    settle(viewer)
    whole = viewer.path
    assert whole.count == len(whole.rows) > 3
    assert f": {len(whole.rows):,} passes" in whole.title()
    monkeypatch.setattr(ray_path, "MOST_ROWS", 3)
    viewer.follow((VIEW[0] // 2, VIEW[1] // 2))
    settle(viewer)
    assert viewer.path.rows == whole.rows[:3] and viewer.path.count == whole.count
    assert f"the first 3 of {whole.count:,} passes" in viewer.path.title()


# Saving -----------------------------------------------------------------------------------------

def test_a_picture_is_saved_with_its_settings(viewer: Viewer, tmp_path: Path) -> None:
    viewer.camera = moves.orbit(viewer.camera, 0.3, 0.1)
    viewer.step()
    first, second = viewer.save(tmp_path), viewer.save(tmp_path)
    assert first != second and viewer.message.endswith(second.name)
    with Image.open(first) as image:
        assert image.size == VIEW
        held = json.loads(image.text["gpgpu-rt"])
        pixels = np.asarray(image)
    assert held == json.loads(first.with_suffix(".json").read_text())
    assert held["camera"] == viewer.view.to_dict() and held["method"] == "bvh-threaded"
    again = tmp_path / "again.png"
    assert main([*shlex.split(held["command"])[1:-1], f"--output={again}"]) == 0
    assert (np.asarray(Image.open(again)) == pixels).all()
    assert viewer.save(tmp_path / "nowhere") is None and "no folder" in viewer.message


@pytest.mark.parametrize("what, other, layout", [
    ("triangles", "brute-force", "side by side"), full("passes", "grid", "wipe")])
def test_a_heat_map_is_saved_whole_with_its_settings(
        viewer: Viewer, tmp_path: Path, capsys, what: str, other: str, layout: str) -> None:
    viewer.camera = moves.orbit(viewer.camera, 0.3, 0.1)
    viewer.look_at("heat")
    viewer.change_heat(what=what, other=other, layout=layout, wipe=0.3)
    viewer.pace.measured(1, 1.0)  # as if a full picture took a second
    viewer.step()
    assert viewer.divisor > 1
    path = viewer.save(tmp_path)
    with Image.open(path) as image:
        pixels, held = np.asarray(image), json.loads(image.text["gpgpu-rt"])
    assert viewer.divisor == 1 and viewer.image.shape[:2] == VIEW[::-1]
    assert (pixels[:VIEW[1], :VIEW[0]] == viewer.image).all()
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


def test_passes_are_saved_with_their_settings(viewer: Viewer, tmp_path: Path) -> None:
    viewer.camera = moves.orbit(viewer.camera, 0.3, 0.1)
    viewer.look_at("passes")
    viewer.step()  # the camera still moves: a coarse picture
    assert viewer.journey is None
    path = viewer.save(tmp_path)
    viewer.go_to(3, "node")
    path = viewer.save(tmp_path)
    held = json.loads(path.with_suffix(".json").read_text())
    assert held["passes"]["pass"] == 3 and held["passes"]["field"] == "node"
    assert held["passes"]["options"]["schedule"] == "step" and held["passes"]["size"] == [*VIEW]
    with Image.open(path) as image:
        assert (np.asarray(image) == viewer.journey.pixels(3, "node")).all()
    words = shlex.split(held["command"])
    assert main([*words[1:-1], f"--output={tmp_path / 'again'}", "--every=1000"]) == 0
    again = json.loads((tmp_path / "again" / "passes.json").read_text())["passes"]
    assert [one["live"] for one in again] == viewer.journey.live.tolist()


def test_without_a_display_one_line_says_so(monkeypatch, capsys) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert main(["view", "cornell"]) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and ("cannot open a window" in said or ".[view]" in said)


@pytest.mark.parametrize("words, said", [
    (["view", "cornell", "-m", "kd-restrat"], "did you mean"),
    (["view", "cornell", "--statistics=true"], "sets statistics itself"),
    (["view", "cornell", "-m", "auto"], "method's name"),
    (["view", "cornell", "--folder", "/nowhere/at/all"], "no such folder"),
    (["view", "cornell", "--octants", "-m", "grid"], "no option --octants"),
])
def test_mistakes_are_one_line(words: list[str], said: str, capsys) -> None:
    assert main(words) == 1
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
