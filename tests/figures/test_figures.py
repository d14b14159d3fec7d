"""Figures: numbers on the pages come from the JSON, and finished cells are kept."""
from __future__ import annotations

import csv
import json
import math

import pytest

from gpgpu_rt.figures import fig12, fig13, fig16, fig20, measure
from gpgpu_rt.figures.__main__ import main
from gpgpu_rt.figures.comparison import Panel
from gpgpu_rt.figures.kendall import tau_b
from gpgpu_rt.figures.measure import Cell
from gpgpu_rt.figures.published_numbers import published

CELL = Cell("cornell", "kd-restart", size=16, runs=1)


@pytest.mark.parametrize("ours, theirs, expected", [
    ([1, 2, 3], [10, 20, 30], 1), ([3, 2, 1], [10, 20, 30], -1),
    ([1, 2, 3, 4], [10, 30, 20, 40], 4 / 6),
    ([1, 2, 3], [10, 10.4, 30], 2 / math.sqrt(3 * 2)), ([1, 1], [1, 1], math.nan)])
def test_tau_b(ours: list, theirs: list, expected: float) -> None:
    assert tau_b(ours, theirs) == pytest.approx(expected, nan_ok=True)


def test_published_numbers() -> None:
    assert published("fig12", "robots", "grid") == 8344
    assert published("fig20", "cornell", "bvh-threaded", "build=goldsmith-salmon") == 103
    assert published("fig12", "robots", "bih") is None


def test_a_finished_cell_is_kept(tmp_path, monkeypatch) -> None:
    measure.measure([CELL], tmp_path)
    first = (tmp_path / CELL.name).read_text()
    result = json.loads(first)
    assert result["median_ms"] > 0 and result["counters"]["triangles_tested"] > 0
    assert len(result["samples_ms"]) == 1 and result["gpu"]["renderer"]
    monkeypatch.setattr(measure, "run", lambda cell: pytest.fail("measured again"))
    measure.measure([CELL], tmp_path)
    assert (tmp_path / CELL.name).read_text() == first
    monkeypatch.undo()
    for damage in ("{", json.dumps({**result, "settings": {}})):
        (tmp_path / CELL.name).write_text(damage)
        measure.measure([CELL], tmp_path)
        assert measure.read(CELL, tmp_path) is not None


def test_interrupting_loses_only_the_running_cell(tmp_path, monkeypatch) -> None:
    whole = measure.run

    def run(cell: Cell):
        if cell.method == "grid":
            raise KeyboardInterrupt
        return whole(cell)
    monkeypatch.setattr(measure, "run", run)
    with pytest.raises(KeyboardInterrupt):
        measure.measure([CELL, Cell("cornell", "grid", size=16, runs=1)], tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == [CELL.name]


FIGURES = (fig12.FIGURE, fig13.FIGURE, fig16.FIGURE, fig20.FIGURE)


@pytest.mark.parametrize("figure", FIGURES, ids=lambda f: f.name)
def test_tables_hold_the_measured_numbers(figure, tmp_path) -> None:
    expected = {}
    stand_in = figure.panels[-1].scene
    for at, (panel, column) in enumerate(figure.pairs()):
        cell = figure.cell(panel, column, False)
        ns = 100.0 + at
        result = {
            "settings": measure.settings(cell), "gpu": {"renderer": "R", "backend": "egl"},
            "date": "2020-01-01", "rays": cell.size ** 2, "ns_per_ray": ns,
            "median_ms": ns * cell.size ** 2 / 1e6, "wall_ms": 1, "statistics": {"passes": 1},
            "counters": {"steps": 5, "nodes_visited": 3, "triangles_tested": 2},
            "scene": {"triangles": 9,
                      "stand_in": "something" if panel.scene == stand_in else None}}
        (tmp_path / cell.name).write_text(json.dumps(result))
        expected[panel.scene, panel.rays or "", column.label] = ns
    figure.draw(tmp_path, tmp_path, False)
    with (tmp_path / f"{figure.name}.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {(r["scene"], r["rays"], r["method"]): float(r["ns_per_ray"])
            for r in rows} == expected
    for row, (panel, column) in zip(rows, figure.pairs()):
        value = published(figure.name, panel.scene, column.published_method or column.method,
                          column.published_options, panel.rays)
        assert row["published"] == ("" if value is None else str(value))
    page = (tmp_path / f"{figure.name}.md").read_text()
    assert "Renderer: R" in page and "stand-in for something" in page
    assert (tmp_path / f"{figure.name}.png").stat().st_size > 10_000


def test_unwritable_folder(tmp_path, capsys) -> None:
    (tmp_path / "file").write_text("")
    status = main(["--data", str(tmp_path / "file" / "data"), "--out", str(tmp_path)])
    assert status == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_an_order_unlike_the_published_one_is_explained(tmp_path) -> None:
    """Times that rise where the paper's fall: every pair of columns is named with its counters."""
    figure = fig20.FIGURE
    for k, column in enumerate(figure.columns):
        cell = figure.cell(Panel("kitchen"), column, False)
        theirs = published("fig20", "kitchen", column.method, column.published_options)
        assert theirs is not None
        (tmp_path / cell.name).write_text(json.dumps({
            "settings": measure.settings(cell), "gpu": {"renderer": "R", "backend": "egl"},
            "date": "2020-01-01", "rays": cell.size ** 2, "ns_per_ray": 1e6 / theirs,
            "median_ms": 1, "wall_ms": 1, "statistics": {"passes": 1},
            "counters": {"steps": 5, "nodes_visited": 100 + k, "triangles_tested": 2},
            "scene": {"triangles": 9, "stand_in": None}}))
    figure.draw(tmp_path, tmp_path, False)
    page = (tmp_path / "fig20.md").read_text()
    assert "Where the order differs" in page
    assert "grid takes 1/" in page and "visits 100 nodes" in page and "visits 104 nodes" in page
