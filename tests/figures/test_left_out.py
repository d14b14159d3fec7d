"""Figures about cards on a machine that cannot count instructions: measured numbers stay, and the
page says why predictions are left out."""
from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from gpgpu_rt.figures.experiments import gap_work, retention
from gpgpu_rt.figures.framework import measure, pages, results, works
from gpgpu_rt.figures.framework.catalogue import FIGURES, figure_of
from gpgpu_rt.figures.framework.cell import Cell
from gpgpu_rt.figures.survey import fig02_shader_pipeline as fig02
from gpgpu_rt.figures.survey import fig26_all_methods as fig26
from gpgpu_rt.figures.survey import pass_work

COUNTED = [name for name in FIGURES
           if any(works.work_of(cell).counted for cell in figure_of(name).cells(False))]


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Measures cells and draws pages in this process. Other processes would use another Mesa than
    the fixtures set here."""
    for module in (measure, pages):
        monkeypatch.setattr(module, "worth_workers", lambda parts: False)


def test_the_figures_that_need_counts_are_known() -> None:
    assert {"fig26", "table1", "period"} == set(COUNTED)


@pytest.mark.parametrize("name", COUNTED)
def test_a_page_without_counts_says_why(name: str, uncountable: str, here, tmp_path: Path,
                                        capsys) -> None:
    """A page says how many cells are left out, and why. The test measures only cells that need
    counts."""
    cells = figure_of(name).cells(False)
    counted = [cell for cell in dict.fromkeys(cells) if works.work_of(cell).counted][:3]
    measure.measure(counted, tmp_path)
    assert f"figures: {len(counted)} of {len(counted)} cells left out: {uncountable}" in (
        capsys.readouterr().err)
    (tmp_path / f"{name}.md").write_text("# An older page")
    for _ in range(2):
        pages.draw([name], tmp_path, tmp_path, False)
        page = (tmp_path / f"{name}.md").read_text()
        assert page.startswith("# ") and "older" not in page
        assert page.count(uncountable) == page.count("## What is left out") == 1
        assert f"{len(counted)} of {len(set(cells))} cells" in page
    assert json.loads((tmp_path / f"{name}.json").read_text())["cells"] == []


def test_what_is_measured_stays(uncountable: str, here, tmp_path: Path) -> None:
    """Two rows of Figure 26 keep their measured numbers. The test measures at a tiny size."""
    some = [entry for entry in fig26.entries() if entry.method in ("ray-engine", "kd-restart")]
    small = {entry: entry.measured(False) for entry in some}
    for cell in small.values():  # write each result under the larger cell's name
        measure.measure([cell_of(cell)], tmp_path)
        result = json.loads((tmp_path / cell_of(cell).name).read_text())
        (tmp_path / cell.name).write_text(json.dumps({
            **result, "settings": results.settings(cell)}))
    measure.measure([entry.counted() for entry in some], tmp_path)
    pages.draw(["fig26"], tmp_path, tmp_path, False)
    with (tmp_path / "fig26.csv").open(newline="") as file:
        rows = {row["method"]: row for row in csv.DictReader(file)}
    assert set(rows) == {"ray-engine", "kd-restart"}
    for row in rows.values():
        assert float(row["measured_ns"]) > 0 and float(row["measured"]) > 0
        assert row["predicted_ns"] == row["predicted"] == ""
    assert (tmp_path / "fig26.png").stat().st_size > 10_000
    assert uncountable in (tmp_path / "fig26.md").read_text()


def cell_of(cell: Cell) -> Cell:
    """Returns a cell with the same rays and a scene that is quick to build."""
    return Cell("cornell", cell.method, cell.options, 16, cell.work, 1)


def test_a_cell_that_was_left_out_is_tried_again(here, tmp_path: Path, monkeypatch,
                                                 countable) -> None:
    """A later run measures a cell again that was left out, because that run may have another Mesa,
    or a killed process may have caused the failure."""
    cell = Cell("cornell", "kd-restart", (), 64, pass_work.PASSES + "eye rays", 1)
    with monkeypatch.context() as within:
        def refuses() -> None:
            raise measure.NotCountable("no counts:\ntoday")
        within.setattr(measure, "check_countable", refuses)
        measure.measure([cell], tmp_path)
        assert results.left_out([cell, cell], tmp_path) == {"no counts: today": 1}
        assert results.read(cell, tmp_path) is None
    measure.measure([cell], tmp_path)
    assert results.left_out([cell], tmp_path) == {}
    assert results.read(cell, tmp_path)["passes"]


def test_bytes_that_are_moved_need_no_counts(uncountable, here, tmp_path: Path) -> None:
    """Retention needs only the log of passes, the runs of kernels need traces, and Figure 2 needs
    only texts and queries."""
    cell = retention.cells(False)[0]
    small = Cell("cornell", cell.method, cell.options, 16, cell.work, 1)
    done = Cell("cornell", cell.method, (), 96, gap_work.DONE + "eye rays", 1)
    measure.measure([small, done], tmp_path)
    found, ran = results.read(small, tmp_path), results.read(done, tmp_path)
    assert found is not None and found["gap"]["bytes"]["rays"] > 0
    assert ran is not None and ran["gap"]["runs"]["down"] > 0
    fig02.shown.cache_clear()
    assert [len(one.by_fragments) for one in fig02.shown()] == [4, 2]
