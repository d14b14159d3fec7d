"""The figure of moving scenes: measured cells are right, and pages and docs show the measured
numbers."""
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

PAGE = Path(__file__).parents[2] / "docs" / "moving-and-large.md"


def test_columns_come_from_the_table() -> None:
    columns = frames.columns()
    labels = [label for label, _, _ in columns]
    assert len(set(labels)) == len(labels)
    refitted = {row.name for row in rt.methods() if row.refit is not None}
    assert refitted == {label.removesuffix(" refitted") for label in labels
                        if label.endswith(" refitted")}
    assert any("sah" in label for label in labels) and "bih rebuilt" in labels
    assert any(method.startswith("kd-") for _, method, _ in columns)


@pytest.mark.parametrize("method, options, rebuilt", [
    ("bvh-threaded", {}, 0), ("bvh-threaded", {"rebuild_ratio": 0.0}, 2), ("bih", {}, 2)])
def test_a_measured_cell(method: str, options: dict, rebuilt: int, monkeypatch) -> None:
    """A measured cell of a small cloth has the times of updating and of tracing for each frame.
    All distances equal those in a newly built tree."""
    monkeypatch.setattr("gpgpu_rt.scene.procedural.animations.CLOTH_CELLS", 20)
    for cached in (frame_times._start, frame_times._vertices, frame_times._distances):
        cached.cache_clear()
    found = frame_times.measure("cloth", method, options, 16, 2)
    assert len(found["update"]) == len(found["trace"]) == 2 and min(found["update"]) > 0
    assert found["rebuilt"] == rebuilt and found["differing"] == 0
    for cached in (frame_times._start, frame_times._vertices, frame_times._distances):
        cached.cache_clear()


def test_pages_hold_the_measured_numbers(tmp_path) -> None:
    expected = {}
    for scene in frames.SCENES:
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
    assert (tmp_path / "frames.png").stat().st_size > 10_000


@pytest.mark.full
@pytest.mark.parametrize("name, at", [("cloth", (8, 48)), ("walker", (8, 48, 96)),
                                      ("explosion", (8, 24, 48))])
def test_how_a_refitted_tree_fares(name: str, at: tuple[int, ...]) -> None:
    page, animation = PAGE.read_text(), rt.load_animation(name)
    built = build_bvh(animation.scene.triangles)
    refitter = Refitter.of(built)
    for frame in at:
        triangles = animation.scene.moved(animation.vertices(frame)).triangles
        cost = sah_cost(refitter.refit(built, triangles))
        last, new = cost / sah_cost(built), cost / sah_cost(
            build_bvh(triangles))
        assert f"| {frame} | {last:.3g} | {new:.3g} |" in page


@pytest.mark.full
def test_what_rays_do_in_a_bih() -> None:
    scene, page = real_scene("bunny"), PAGE.read_text().replace("\n", " ")
    said = []
    for method, options in (("bih", {}), ("bvh-threaded", {}), ("bih", {"stack_size": 16})):
        with rt.Tracer(scene, method, statistics=True, **options) as tracer:
            tracer.trace(*scene.camera.rays((256, 256)))
            said.append({k: f"{v:.3g}" for k, v in tracer.statistics.counters.items()})
    bih, bvh, stack = said
    assert f"enters {bih['leaves_visited']} of its leaves" in page
    assert f"into {bvh['leaves_visited']}, and tests {bih['triangles_tested']} triangles" in page
    assert f"against {bvh['triangles_tested']}." in page
    assert f"({bih['nodes_visited']} to {stack['nodes_visited']} on the bunny)" in page
