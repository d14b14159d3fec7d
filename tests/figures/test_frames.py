"""Tests of the figure `frames`, which measures moving scenes: its measurements (cells) are right,
and pages and docs show the measured numbers."""
from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from conftest import real_scene

import gpgpu_rt as rt
from gpgpu_rt.figures.experiments import frame_times, frames
from gpgpu_rt.figures.framework import results
from gpgpu_rt.methods.bvh.build import build_bvh
from gpgpu_rt.methods.bvh.refit import Refitter
from gpgpu_rt.methods.quality import sah_cost
from gpgpu_rt.scene import catalogue
from gpgpu_rt.text_format import number

PAGE = Path(__file__).parents[2] / "docs" / "moving-and-large.md"
NOTE = PAGE.parent / "notes" / "moving.md"


def test_columns_come_from_the_table() -> None:
    """The table of methods decides the columns: each method that can refit has a column for
    refitting."""
    columns = frames.columns()
    labels = [label for label, _, _ in columns]
    assert len(set(labels)) == len(labels)
    refitted = {row.name for row in rt.methods() if row.refit is not None}
    assert refitted == {label.removesuffix(" refitted") for label in labels
                        if label.endswith(" refitted")}
    assert any("sah" in label for label in labels) and "bih rebuilt" in labels
    assert labels.index(frames.OVERLAPPED) == labels.index(frames.IN_TURN) + 1
    assert any(method.startswith("kd-") for _, method, _ in columns)


@pytest.mark.parametrize("method, options, rebuilt", [
    ("bvh-threaded", {}, 0), ("bvh-threaded", {"rebuild_ratio": 0.0}, 2), ("bih", {}, 2),
    ("kd-stack", {}, 2), ("kd-stack", dict([frame_times.AHEAD]), 2)])
def test_a_measured_cell(method: str, options: dict, rebuilt: int, monkeypatch) -> None:
    """A measured cell of a small cloth has the times of updating and of tracing for each frame.
    All hit distances equal those of a newly built tree."""
    monkeypatch.setattr("gpgpu_rt.scene.procedural.animations.CLOTH_CELLS", 20)
    for cached in (frame_times._start, frame_times._vertices, frame_times._distances):
        cached.cache_clear()
    found = frame_times.measure("cloth", method, options, 16, 2)
    assert len(found["update"]) == len(found["trace"]) == 2 and min(found["update"]) > 0
    assert found["rebuilt"] == rebuilt and found["differing"] == 0
    for cached in (frame_times._start, frame_times._vertices, frame_times._distances):
        cached.cache_clear()


@pytest.mark.parametrize("found", [False, True])
def test_scenes_are_measured_if_their_file_exists(found: bool, tmp_path, monkeypatch) -> None:
    """A scene without its file has no cells, and the page says how to get the file."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GPGPU_RT_SCENES", str(tmp_path))
    names = {"robots-moving", "kitchen-moving"}
    for name in names if found else ():
        file = tmp_path / catalogue.ROWS[name].file
        file.parent.mkdir(parents=True)
        file.write_text("")
    scenes = {cell.scene for cell in frames.cells(True)}
    assert scenes == {*frames.SCENES} - (set() if found else names)
    assert not {cell.scene for cell in frames.cells(False)} & names
    frames.draw(tmp_path, tmp_path, True)
    page = (tmp_path / "frames.md").read_text()
    assert ("run `gpgpu-rt scenes --fetch robots`" in page) != found


def test_a_scene_is_measured_from_its_first_frame(tmp_path, monkeypatch) -> None:
    """The scene starts at the frame that `frame_times.FIRST` gives for the scene, with the
    camera of this frame."""
    file = tmp_path / catalogue.ROWS["kitchen-moving"].file
    file.parent.mkdir(parents=True)
    keys, view = ("".join(f"{time} {x} 0 {z} 0 0 0 " for time, x in (
        (0, 0), (0, 0), (100, 100), (101, 101))) for z in (0, 9))
    file.write_text("v from 0 0 9 at 0 0 0 up 0 1 0 angle 40 hither 1 resolution 9 9\n"
                    "a 0 100 1001 p 3 -9 -9 0 9 -9 0 0 9 0 x car { p 3 0 0 1 1 0 1 0 1 1 }"
                    f"k car {{ transl 4 {keys} }} k camera {{ transl 4 {view} }}")
    monkeypatch.setenv("GPGPU_RT_SCENES", str(tmp_path))
    caches = frame_times._animation, frame_times._start, frame_times._vertices
    for cached in (*caches, frame_times._distances):
        cached.cache_clear()
    start = frame_times._start("kitchen-moving")
    x = start.triangles[1, 0, 0]
    assert 10 < x < 30 and start.camera.eye == pytest.approx((x, 0, 9))
    found = frame_times.measure("kitchen-moving", "bvh-threaded", {}, 16, 2)
    assert len(found["update"]) == 2 and found["differing"] == 0
    for cached in (*caches, frame_times._distances):
        cached.cache_clear()


def test_pages_show_the_measured_numbers(tmp_path) -> None:
    expected = {}
    for scene in filter(frames.is_there, frames.SCENES):
        for at, (label, method, options) in enumerate(frames.columns()):
            cell = frames.cell(scene, method, options, False)
            seconds = 0.01 * (at + 1)
            (tmp_path / cell.name).write_text(json.dumps({
                "settings": results.settings(cell), "gpu": {"renderer": "R", "backend": "egl"},
                "scene": {"triangles": 9, "stand_in": "a thing" if scene == "bunny" else None},
                "frames": {"update": [seconds, seconds, 5.0], "trace": [0.001] * 3,
                           "rebuilt": 1, "differing": 0}}))
            expected[scene, label] = 1e3 * seconds
    frames.draw(tmp_path, tmp_path, False)
    with (tmp_path / "frames.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {(row["scene"], row["method"]): float(row["update_ms"])
            for row in rows} == pytest.approx(expected)
    assert float(rows[0]["frames_a_second"]) == pytest.approx(3 / (5.02 + 0.003))
    page = (tmp_path / "frames.md").read_text()
    assert "stand-in for a thing" in page and "nothing moves" in page and "1 of 3" in page
    turn, ahead = (expected["cloth", label] for label in (frames.IN_TURN, frames.OVERLAPPED))
    rates = [3e3 / (2 * ms + 5003) for ms in (ahead, turn)]
    assert (f"cloth, kd-stack: {number(rates[0])} frames a second with the overlap and "
            f"{number(rates[1])} without overlap") in page
    assert f"would give {number((turn + 1) / turn)} times as many" in page
    assert "Budge et al. 2008" in page
    assert (tmp_path / "frames.png").stat().st_size > 10_000


@pytest.mark.full
@pytest.mark.parametrize("name, at", [("cloth", (8, 48)), ("walker", (8, 48, 96)),
                                      ("explosion", (8, 24, 48))])
def test_refitted_trees_cost_what_the_note_says(name: str, at: tuple[int, ...]) -> None:
    """The note gives two ratios of SAH costs: refitted tree to first frame's tree, and refitted
    tree to newly built tree."""
    page, animation = NOTE.read_text(), rt.load_animation(name)
    built = build_bvh(animation.scene.triangles)
    refitter = Refitter.of(built)
    for frame in at:
        triangles = animation.scene.moved(animation.vertices(frame)).triangles
        cost = sah_cost(refitter.refit(built, triangles))
        last, new = cost / sah_cost(built), cost / sah_cost(
            build_bvh(triangles))
        assert f"| {frame} | {last:.3g} | {new:.3g} |" in page


@pytest.mark.full
def test_counters_of_a_bih_are_as_the_page_says() -> None:
    scene, page = real_scene("bunny"), PAGE.read_text().replace("\n", " ")
    said = []
    for method, options in (("bih", {}), ("bvh-threaded", {}), ("bih", {"stack_size": 16})):
        with rt.Tracer(scene, method, statistics=True, **options) as tracer:
            tracer.trace(*scene.camera.rays((256, 256)))
            said.append({k: f"{v:.3g}" for k, v in tracer.statistics.counters.items()})
    bih, bvh, stack = said
    for name, counted in (("by `bih`", bih), ("by a BVH", bvh)):
        assert (f"{name} a ray enters {counted['leaves_visited']} leaves and tests "
                f"{counted['triangles_tested']} triangles" in page), name
    assert f"from {bih['nodes_visited']} to {stack['nodes_visited']}." in page
