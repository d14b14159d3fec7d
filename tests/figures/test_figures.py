"""Tests of figures: pages show the numbers of the measurements (cells), and a finished cell is not
measured again."""
from __future__ import annotations

import csv
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.bench.workloads import workload
from gpgpu_rt.figures.command import main
from gpgpu_rt.figures.framework import measure, published_numbers, results
from gpgpu_rt.figures.framework.catalogue import FIGURES, figure_of
from gpgpu_rt.figures.framework.cell import ON_CPU, PERIOD_TEST, Cell
from gpgpu_rt.figures.framework.comparison import Panel
from gpgpu_rt.figures.framework.kendall import tau_b
from gpgpu_rt.figures.framework.published_numbers import (
    nanoseconds, published, published_range, published_row
)
from gpgpu_rt.figures.survey import fig05_ray_engine_times as fig05
from gpgpu_rt.figures.survey import fig12_eye_rays as fig12
from gpgpu_rt.figures.survey import fig13_horn_improvements as fig13
from gpgpu_rt.figures.survey import fig14_mirrors as fig14
from gpgpu_rt.figures.survey import fig16_ropes_and_packets as fig16
from gpgpu_rt.figures.survey import fig17_rope_memory as fig17
from gpgpu_rt.figures.survey import fig20_whole_images as fig20
from gpgpu_rt.figures.survey import fig22_large_scenes as fig22
from gpgpu_rt.figures.survey import tree_sizes
from gpgpu_rt.methods.kdtree.tree import LEAF as KD_LEAF_AXIS

# No paper publishes numbers for these columns, because only this program has them.
NOT_PUBLISHED = {("fig13", fig13.SKIPPING), ("fig22", fig22.FAST), ("fig22", fig22.CPU)}
COMPARISONS = [fig12.FIGURE, fig13.FIGURE, fig16.FIGURE, fig20.FIGURE, fig22.FIGURE]
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


# The ranges that the survey prints.
RANGES = {(20e6, 40e6), (300e3, 1e6), (2, 4), (2, 3), (30, 50), (50, 100)}


def test_published_ranges_keep_both_ends() -> None:
    assert {(float(row["value"]), float(row["high"])) for row in published_numbers._rows()
            if row["high"]} == RANGES
    assert published_range("text", "", "rpu") == (50, 100)
    assert published_range("fig12", "robots", "grid") == (8344, 8344)
    assert not any("end of" in row["note"] for row in published_numbers._rows())
    with pytest.raises(ValueError, match="range"):
        published("text", "", "rpu")


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
        assert results.read(CELL, tmp_path) is not None


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


def _fake(cell: Cell, folder: Path, ns: float, nodes: float = 3, stand_in: str | None = None,
          **more: Any) -> None:
    """Writes a cell's file as if the cell had been measured."""
    ms = ns * cell.size ** 2 / 1e6
    (folder / cell.name).write_text(json.dumps({
        "settings": results.settings(cell), "gpu": {"renderer": "R", "backend": "egl"},
        "date": "2020-01-01", "rays": cell.size ** 2, "ns_per_ray": ns,
        "median_ms": ms, "samples_ms": [ms, 2 * ms, ms / 2], "wall_ms": 1,
        "statistics": {"passes": 1},
        "counters": {"steps": 5, "nodes_visited": nodes, "triangles_tested": 2},
        "scene": {"triangles": 9, "stand_in": stand_in}, **more}))


@pytest.mark.parametrize("full", [False, True], ids=["quick", "full"])
def test_no_two_cells_share_a_file(full: bool) -> None:
    cells = {cell for name in FIGURES for cell in figure_of(name).cells(full)}
    assert len({cell.name for cell in cells}) == len(cells)


@pytest.mark.parametrize("figure", COMPARISONS, ids=lambda f: f.name)
def test_tables_show_the_measured_numbers(figure, tmp_path) -> None:
    expected = {}
    panels = list(dict.fromkeys(panel for panel, _ in figure.pairs(False)))
    for at, (panel, column) in enumerate(figure.pairs(False)):
        _fake(figure.cell(panel, column, False), tmp_path, 100.0 + at,
              stand_in="something" if panel.scene == panels[1].scene else None)
        expected[panel.scene, panel.rays or "", column.label] = 100.0 + at
    figure.draw(tmp_path, tmp_path, False)
    with (tmp_path / f"{figure.name}.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {(r["scene"], r["rays"], r["method"]): float(r["ns_per_ray"])
            for r in rows} == expected
    assert all(float(row["max_ms"]) == 2 * float(row["median_ms"]) == 4 * float(row["min_ms"])
               and row["runs"] == "3" for row in rows)
    for row, (panel, column) in zip(rows, figure.pairs(False)):
        value = published(figure.name, panel.scene, column.published_method or column.method,
                          column.published_options, panel.rays)
        if (figure.name, column.label) in NOT_PUBLISHED:
            assert value is None and row["published"] == ""
        else:
            assert value is not None and float(row["published"]) == value
    page = (tmp_path / f"{figure.name}.md").read_text()
    assert "Renderer: R" in page and "stand-in for something" in page
    assert "test triangles as Möller and Trumbore 1997 do" in page
    assert all(f"## {panel.label}" in page for panel in panels)
    assert (tmp_path / f"{figure.name}.png").stat().st_size > 10_000


@pytest.mark.parametrize("full", [False, True], ids=["quick", "full"])
@pytest.mark.parametrize("figure", COMPARISONS, ids=lambda f: f.name)
def test_papers_are_compared_with_the_triangle_test_of_their_time(figure, full: bool) -> None:
    """Every cell of one of our methods names the triangle test of the papers' time (PERIOD_TEST)
    exactly once. A cell of embreex names no triangle test."""
    for cell in figure.cells(full):
        tests = [option for option in cell.options if option[0] == PERIOD_TEST[0]]
        assert tests == ([] if cell.method == ON_CPU else [PERIOD_TEST])


def test_unwritable_folder(tmp_path, capsys) -> None:
    (tmp_path / "file").write_text("")
    status = main(["--data", str(tmp_path / "file" / "data"), "--out", str(tmp_path)])
    assert status == 1
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("name, near", [("11", "fig11"), ("1", "fig01"), ("stack", "stacks")])
def test_an_unknown_figure_gets_a_suggestion(name: str, near: str, capsys) -> None:
    with pytest.raises(SystemExit):
        main(["--only", name])
    assert f"no figure {name!r}; did you mean {near}" in capsys.readouterr().err


def test_an_order_unlike_the_paper_s_is_explained(tmp_path) -> None:
    """If the measured order of two columns differs from the published order, the page names the
    two columns and their counters."""
    figure = fig20.FIGURE
    for k, column in enumerate(figure.columns):
        theirs = published("fig20", "kitchen", column.method, column.published_options)
        assert theirs is not None
        _fake(figure.cell(Panel("kitchen"), column, False), tmp_path, 1e6 / theirs, 100 + k)
    figure.draw(tmp_path, tmp_path, False)
    page = (tmp_path / "fig20.md").read_text()
    assert "Where the order differs" in page
    assert "grid takes 1/" in page and "visits 100 nodes" in page and "visits 104 nodes" in page


def test_every_published_cell_has_a_column() -> None:
    """Figures 13, 16 and 22 show every number that the survey prints in these figures, except two
    CPU columns."""
    for figure, left_out in ((fig13.FIGURE, set()), (fig22.FIGURE, set()),
                             (fig16.FIGURE, {"openrt-frustum-packet", "rope-packet-cpu"})):
        ours = {(panel.scene, column.published_method or column.method, column.published_options,
                 panel.rays) for panel, column in figure.pairs(True)
                if (figure.name, column.label) not in NOT_PUBLISHED}
        theirs = {(row["scene"], row["method"], row["options"], row["rays"])
                  for row in published_numbers._rows() if row["figure"] == figure.name
                  and row["method"] not in left_out}
        assert ours == theirs


@pytest.mark.parametrize("asked, expected", [
    (("fig12", "cornell", "brute-force"), 23e6 / 512 ** 2),
    (("fig13", "cornell", "kd-restart"), 1e3 / 38.3),
    (("fig16", "bunny", "kd-ropes"), 1e9 / 8.9 / 1024 ** 2)], ids=["ms", "Mrays/s", "frames/s"])
def test_published_nanoseconds(asked: tuple[str, ...], expected: float) -> None:
    assert nanoseconds(published_row(*asked)) == pytest.approx(expected)


def test_tau_leaves_out_the_cpu(tmp_path) -> None:
    """In Figure 16, the rank correlation tau-b leaves out embreex."""
    figure, panel = fig16.FIGURE, Panel("bunny", "primary")
    for ns, column in zip((1, 300, 200), figure.columns):
        _fake(figure.cell(panel, column, False), tmp_path, ns)
    figure.draw(tmp_path, tmp_path, False)
    page = (tmp_path / "fig16.md").read_text()
    assert "bunny, primary, 9 triangles: tau-b here 1" in page
    assert "packets have 1.5 times the rate of single rays, 1.43 times in the paper" in page


def test_a_packet_s_visit_counts_once() -> None:
    """A packet's visit of a node counts once, not once for each ray of the packet. The number of
    visits is divided by the number of live rays; pixels without a ray are not counted."""
    cell = Cell("cornell", "kd-packet", size=16, work="mirror rays 3", runs=1)
    result = measure.run(cell)
    rays = workload("cornell", "mirror rays 3", 16)
    with rt.Tracer("cornell", "kd-packet", statistics=True) as tracer:
        hits = rays.trace(tracer)
    # each ray of a packet stores the packet's count
    first = hits.nodes_visited.reshape(16, 16)[::2, ::2]
    assert result["rays"] == rays.live < 256
    assert result["counters"]["nodes_visited"] == pytest.approx(first.sum() / rays.live)


@pytest.mark.parametrize("last, says", [
    (0.5, "The claim holds on"), (1.5, "The claim holds in part on"),
    (3.0, "The claim does not hold on")])
def test_mirrors_and_packets(last: float, says: str, tmp_path) -> None:
    """Figure 14 shows the verdict, and the ratio of rates at each bounce and over all bounces so
    far. A packet of four rays visits 5 nodes per ray, which is 20 nodes. A single ray visits only
    10 nodes, so the rays of a packet take different paths."""
    for bounces in fig14.BOUNCES:
        ratio = 2 + (last - 2) * bounces / 5
        for method, ns, nodes in ((fig14.SINGLE, 100.0, 10), (fig14.PACKET, 100.0 / ratio, 5)):
            _fake(fig14.cell("robots", method, bounces, False), tmp_path, ns, nodes)
    fig14.draw(tmp_path, tmp_path, False)
    with (tmp_path / "fig14.csv").open() as file:
        rows = list(csv.DictReader(file))
    ratios = np.array([float(row["rate of packets / single"]) for row in rows])
    assert ratios == pytest.approx(np.linspace(2, last, 6))
    so_far = [float(row["rate of packets / single so far"]) for row in rows]
    assert so_far == pytest.approx(np.arange(1, 7) / np.cumsum(1 / ratios))
    page = (tmp_path / "fig14.md").read_text()
    assert says in page and ("slower than single rays at bounce" in page) == (last < 1)


def test_sizes_with_ropes(tmp_path) -> None:
    """Figure 17 computes its bytes from the tree's own arrays."""
    scene = rt.load_scene("shirley6")
    found = tree_sizes.measure(scene, {"max_depth": 6})
    with rt.Tracer(scene, "kd-ropes", max_depth=6) as tracer:
        tree = tracer.accelerator.structure
    leaves = int((tree.axis == KD_LEAF_AXIS).sum())
    assert tree.depth == 6 and found["leaves"] == leaves
    assert found["bytes"] == 8 * len(tree.axis) + 4 * len(tree.references)
    assert found["bytes_ropes"] == found["bytes"] + 48 * leaves
    for scene_name, overhead in (("bunny", 3.2), ("conference", 2.7)):
        _fake(fig17.cell(scene_name), tmp_path, 1, tree={**found, "overhead": overhead})
    fig17.draw(tmp_path, tmp_path, False)
    page = (tmp_path / "fig17.md").read_text()
    assert "3.2 times as large, within 10%" in page
    assert "2.7 times as large, not within 10%" in page
    assert f"| {leaves:,} |" in page and "| 349,833 |" in page


@pytest.mark.parametrize("transfer, pairs, says", [
    (1.0, 8, "transfers cost more, as the survey says"),
    (6.0, 80, "transfers cost less, contrary to the survey")])
def test_parts_of_the_ray_engine_s_time(transfer: float, pairs: int, says: str,
                                        tmp_path) -> None:
    """Figure 5 shows the bytes per ray, the verdict, and rates that are computed from seconds or
    from bytes."""
    cell = fig05.cell("cornell", "as it is", False)
    rays = cell.size ** 2
    split = {"traversal_seconds": 1.0, "transfer_seconds": transfer, "intersection_seconds": 5.0,
             "host_intersection_seconds": 0.0, "bytes_up": 100 * rays, "bytes_down": 40 * rays,
             "batches": 3, "quads": 2 * rays, "pairs": pairs * rays, "host_rays": 0}
    total = sum(value for name, value in split.items() if name.endswith("seconds"))
    _fake(cell, tmp_path, 1, statistics={"trace_seconds": total, "split": split},
          stand_in="something")
    fig05.draw(tmp_path, tmp_path, False)
    with (tmp_path / "fig05.csv").open() as file:
        row, = csv.DictReader(file)
    values = {name: float(row[name]) for name in fig05.HEADS[2:]}
    assert values["rays/s"] == pytest.approx(rays / total)
    assert values["rays/s, infinitely fast passes"] == pytest.approx(rays / (total - 5))
    assert values["rays/s, transfers alone"] == pytest.approx(rays / transfer)
    assert values["rays/s, AGP 4x bus alone"] == pytest.approx(
        1 / (100 / 1066e6 + 40 / 266e6))
    assert values["bytes up a ray"] == 100 and values["pairs a quad"] == pairs / 2
    assert values["extra bytes a ray if quads carried corners"] == 72
    page = (tmp_path / "fig05.md").read_text()
    assert says in page and "stand-in for something" in page and "114,499" in page
    assert "300,000 to 1,000,000 rays/s of a CPU core" in page
    assert "114 million tests/s on the R200, and as 20 to 40 million on a CPU" in page
    assert (tmp_path / "fig05.png").stat().st_size > 10_000


def test_the_ray_engine_is_measured_with_its_split(tmp_path) -> None:
    cell = Cell("cornell", "ray-engine", size=16, runs=1)
    measure.measure([cell], tmp_path)
    split = json.loads((tmp_path / cell.name).read_text())["statistics"]["split"]
    assert split["batches"] > 0 and split["intersection_seconds"] > 0
