"""The figure's page entry_points.md and the table of entry points in docs/notes/bvh.md show
measured numbers."""
from __future__ import annotations

import csv
from pathlib import Path

import pytest
from conftest import real_scene

import gpgpu_rt as rt
from gpgpu_rt.figures.experiments import entry_points
from gpgpu_rt.figures.framework import measure

PAGE = Path(__file__).parents[2] / "docs" / "notes" / "bvh.md"


def test_measured_cells_are_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(entry_points, "SCENES", ("cornell",))
    monkeypatch.setattr(entry_points, "METHODS", entry_points.METHODS[:1])
    monkeypatch.setattr(entry_points, "BOUNDED", entry_points.BOUNDED[-1:])
    measure.measure(entry_points.cells(False), tmp_path)
    entry_points.draw(tmp_path, tmp_path, False)
    with (tmp_path / "entry_points.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(entry_points.METHODS) + len(entry_points.BOUNDED)
    for row in rows:
        assert float(row["fewer_by"]) > (1.5 if row["by"] == "entry points" else 1)
        total = float(row["nodes_left"]) + float(row["nodes_of_beams"])
        assert float(row["nodes"]) == pytest.approx(float(row["fewer_by"]) * total)
    assert "| cornell | bvh-threaded |" in (tmp_path / "entry_points.md").read_text()
    assert (tmp_path / "entry_points.png").stat().st_size > 10_000


def page_rows() -> dict[str, list[dict[str, float]]]:
    """Returns four rows of docs/notes/bvh.md for each method with its options. A row maps scenes
    to numbers.

    Three rows have numbers of nodes: visited by rays without entry points, visited by rays with
    entry points, and visited by beams. The fourth row is the first row divided by the sum of the
    second and the third row.
    """
    found: dict[str, list[dict[str, float]]] = {}
    scenes, rows = [], None
    for line in PAGE.read_text().splitlines():
        if not line.startswith("|"):
            scenes = []  # the table has ended
        name, *values = (cell.strip() for cell in line.strip("|").split("|"))
        if name == "entry points":
            scenes = values
        elif scenes and values and not line.startswith("|--"):
            if name.endswith(": nodes"):
                rows = found[name.removesuffix(": nodes")] = []
            rows.append(dict(zip(scenes, map(float, values))))
    return found


@pytest.mark.full
@pytest.mark.parametrize("scene", ["bunny", "robots", "kitchen", "conference"])
@pytest.mark.parametrize("words", page_rows())
def test_the_page_says_what_is_measured(words: str, scene: str) -> None:
    method, *switches = words.split()
    options = {switch.strip("-"): True for switch in switches}
    without, left, beams, fewer = (row[scene] for row in page_rows()[words])
    real = real_scene(scene)
    nodes = []
    for entries in (None, 16):
        with rt.Tracer(real, method, statistics=True, entry_points=entries, **options) as tracer:
            tracer.trace(*real.camera.rays((256, 256)))
            nodes.append(tracer.statistics.counters["nodes_visited"])
            driver = tracer.statistics.driver
    assert nodes == pytest.approx([without, left], rel=0.006)
    assert driver["entry_nodes_visited"] == pytest.approx(beams, rel=0.006)
    assert nodes[0] / (nodes[1] + driver["entry_nodes_visited"]) == pytest.approx(fewer, rel=0.006)
