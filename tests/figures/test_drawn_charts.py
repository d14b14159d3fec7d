"""Two charts, which no other test draws, obey the rules of charts (`chart_rules.py`)."""
from __future__ import annotations

from pathlib import Path

from faked_cells import write_cell
from PIL import Image

from gpgpu_rt.bench.workloads import EYE
from gpgpu_rt.figures.experiments import extremes, ray_sorting
from gpgpu_rt.figures.framework.cell import Cell
from gpgpu_rt.figures.framework.works import COHERENCE

COHERENT = {"nodes_a_ray": 31.0, "distinct_as_they_come": 1890.0, "distinct_sorted": 410.0,
            "waiting_as_they_come": 2.5, "waiting_sorted": 1.5}


def test_ray_sorting(tmp_path: Path) -> None:
    for cell in ray_sorting.cells(False):
        write_cell(cell, tmp_path, median_ms=87.25, sort_ms=12.5, coherence=COHERENT)
    assert any(cell.work == COHERENCE + EYE for cell in ray_sorting.cells(False))
    ray_sorting.draw(tmp_path, tmp_path, False)
    with Image.open(tmp_path / "ray_sorting.png") as chart:
        assert "Bars show the time to trace rays" in chart.info["Description"]


def test_extremes(tmp_path: Path) -> None:
    counts = {"leak": 3, "false hit": 0, "unfinished": 1}
    results = {Cell("extremes", method, (), 1, "extremes", 1): {
        "cases": {name: {"rays": 1000, "counts": counts} for name in extremes.FAMILIES}}
        for method in ("grid", "kd-restart")}
    extremes._chart(results, tmp_path / "extremes.png", "llvmpipe X")
    with Image.open(tmp_path / "extremes.png") as chart:
        assert "A map with a row for each setting" in chart.info["Description"]
