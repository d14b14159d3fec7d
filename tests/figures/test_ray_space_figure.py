"""The figure on `ray-classification` and `visibility-field`: measured cells become table rows,
sentences and a chart."""
from __future__ import annotations

import csv
from pathlib import Path

import pytest

from gpgpu_rt.bench.workloads import EYE
from gpgpu_rt.figures.experiments import ray_space
from gpgpu_rt.figures.framework import measure


def test_cells_have_different_names() -> None:
    quick, full = ray_space.cells(False), ray_space.cells(True)
    assert len({cell.name for cell in full}) == len(full) == 54
    assert len(quick) == 36 and {cell.size for cell in quick} == {64}


def test_measured_cells_are_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ray_space, "SCENES", ("cornell", "cornell"))
    monkeypatch.setattr(ray_space, "WORK", (EYE,))
    monkeypatch.setattr(ray_space, "BUDGETS", (16,))
    monkeypatch.setattr(ray_space, "RUNS", 1)
    measure.measure(ray_space.cells(False), tmp_path)
    ray_space.draw(tmp_path, tmp_path, False)
    with (tmp_path / "ray_space.csv").open() as file:
        rows = {row["method"]: row for row in csv.DictReader(file)}
    assert set(rows) == {"ray-classification, 16 MiB", "visibility-field, 16 MiB", "kd-restart",
                         "bvh-threaded"}
    boxes = rows["ray-classification, 16 MiB"]
    assert 3 < float(boxes["mib"]) < 16 and float(boxes["lists"]) > 6
    assert all(0 < float(row["tested"]) < 32 for row in rows.values())
    page = (tmp_path / "ray_space.md").read_text()
    assert "ray-classification, 16 MiB traces" in page and "bvh-threaded" in page
    assert (tmp_path / "ray_space.png").stat().st_size > 10_000


def test_findings_follow_from_the_rows() -> None:
    common = {"scene": "s", "rays": EYE, "visited": 1.0}
    rows = [{**common, "method": "kd-restart", "rays_per_second": 50.0, "tested": 5.0, "mib": 2.0},
            {**common, "method": "bvh-threaded", "rays_per_second": 100.0, "tested": 4.0,
             "mib": 1.0},
            {**common, "method": "visibility-field, 32 MiB", "rays_per_second": 25.0,
             "tested": 40.0, "mib": 30.0}]
    said, = ray_space.findings(rows)
    assert said == ("s, eye rays: visibility-field, 32 MiB traces 0.25 times as many rays per "
                    "second as bvh-threaded. It tests 10 times as many triangles, and needs 30 "
                    "times the memory.")
