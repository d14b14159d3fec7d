"""The trade-off figure draws the Pareto front and shows the measured numbers."""
from __future__ import annotations

import csv
import json

import pytest

import gpgpu_rt as rt
from gpgpu_rt.figures.experiments import tradeoff
from gpgpu_rt.figures.framework import measure
from gpgpu_rt.figures.framework.cell import Cell


def test_no_point_beats_the_pareto_front() -> None:
    """`pareto` returns the indices of the points (rate, error) that no other point beats, from the
    highest rate to the lowest."""
    points = [(1.0, 1e-5), (5.0, 1e-1), (2.0, 1e-5), (4.0, 1e-1), (3.0, 1e-3), (2.5, 1e-2)]
    assert tradeoff.pareto(points) == [1, 4, 2]
    assert tradeoff.pareto([]) == []


@pytest.mark.parametrize("full", [False, True])
def test_cells_cover_methods_and_precisions(full: bool) -> None:
    cells = tradeoff.cells(full)
    assert len(set(cells)) == len(cells) and {c.work for c in cells} == {"accuracy"}
    assert {c.method for c in cells} == {r.name for r in rt.methods() if full or "loop" in
                                         r.schedules} - {"brute-force"}
    assert all(("precision", "fp16") in [pair for c in cells if c.method == name
                                         for pair in c.options] for name in ("grid", "kd-restart"))


def test_a_measured_cell_is_drawn(tmp_path, monkeypatch) -> None:
    cells = [Cell("cornell", "bvh-threaded", options, 8, "accuracy", 1)
             for options in ((), (("precision", "fp16"),))]
    monkeypatch.setattr(tradeoff, "scenes", lambda full: ("cornell",))
    monkeypatch.setattr(tradeoff, "cells_of", lambda scene, full: cells)
    measure.measure(cells, tmp_path)
    exact, coarse = (json.loads((tmp_path / cell.name).read_text()) for cell in cells)
    assert exact["rays"] == 256 and exact["accuracy"]["all"]["wrong"] == 0 < exact["median_ms"]
    tradeoff.draw(tmp_path, tmp_path, False)
    with (tmp_path / "tradeoff.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["precision"] for row in rows] == ["fp32", "fp16"]
    # A setting without wrong rays is drawn at the upper bound of its share of wrong rays.
    assert float(rows[0]["drawn_wrong"]) == float(rows[0]["upper_95"]) > 0.01
    assert float(rows[1]["drawn_wrong"]) == coarse["accuracy"]["all"]["wrong_share"] > 0
    assert "fp16" in (tmp_path / "tradeoff.md").read_text()
    assert (tmp_path / "tradeoff.png").stat().st_size > 10_000
