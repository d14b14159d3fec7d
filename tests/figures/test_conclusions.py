"""The pages of Figures 2 and 26, of Table 1 and of the figure `cpu`, their verdicts and the index
show the numbers in the files of the measurements (cells)."""
from __future__ import annotations

import csv
import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from faked_cells import write_cell

from gpgpu_rt.bench.engines import CORES, EMBREE
from gpgpu_rt.bench.workloads import EYE, load, workload
from gpgpu_rt.figures import command
from gpgpu_rt.figures.experiments import cpu, cpu_peak
from gpgpu_rt.figures.framework import measure, pages, provenance, verdicts
from gpgpu_rt.figures.framework.catalogue import FIGURES
from gpgpu_rt.figures.framework.cell import ON_CPU, PERIOD_TEST, Cell
from gpgpu_rt.figures.framework.comparison import Panel
from gpgpu_rt.figures.framework.contradictions import CONTRADICTIONS, of_page
from gpgpu_rt.figures.framework.published_numbers import published
from gpgpu_rt.figures.survey import fig02_shader_pipeline as fig02
from gpgpu_rt.figures.survey import fig12_eye_rays as fig12
from gpgpu_rt.figures.survey import fig26_all_methods as fig26
from gpgpu_rt.figures.survey import ray_engine_work, scaled, surveyed
from gpgpu_rt.figures.survey import table1_methods as table1
from gpgpu_rt.hardware.cards import find_card
from gpgpu_rt.hardware.machine_model import ASSUMED, stream_fetches
from gpgpu_rt.hardware.static_costs import static_cost
from gpgpu_rt.methods.references import find_work

STRUCTURES = {"grid": "Grid", "ray-engine": "Grid", "ray-tiles": "tuple",
              "ray-hierarchy": "NoneType", "geometry-image": "ImageTree"}


def _timed(entry: surveyed.SurveyedMethod, ns: float, folder: Path) -> None:
    name = entry.method
    kind = STRUCTURES.get(name, "KdTree" if name.startswith("kd-") else "Bvh")
    write_cell(entry.measured(False), folder, ns_per_ray=ns, median_ms=ns, structure=kind)


def _rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_every_row_of_table_1_has_a_method() -> None:
    assert list(surveyed.STANDS_FOR) == list(surveyed.table1())
    assert surveyed.published_speed("Budge et al. 2008") == 68.6
    assert surveyed.published_speed("Purcell et al. 2002") is None
    methods = [entry.method for entry in surveyed.entries()]
    assert set(methods) == {row.name for row in surveyed.rt.methods()}


def test_rates_are_interpolated_in_logarithms() -> None:
    """The rate at 10,000 triangles is interpolated: the logarithm of the rate is linear in the
    logarithm of the number of triangles."""
    points = [(100, 8.0), (1_000_000, 2.0)]
    assert scaled.at_triangles(points) == pytest.approx(4)
    assert [scaled.at_triangles([one]) for one in points] == pytest.approx([8, 2])


def test_rates_are_scaled_as_in_the_survey() -> None:
    """Each paper's rate is scaled to a GeForce 8800, and divided by the scaled rate of the Ray
    Engine. Foley's rate is from an X800 with 8.32 billion instructions a second, and the Ray
    Engine's rate is from a GeForce4 with 2.4 billion."""
    rows = {row.source: row for row in scaled.scaled()}
    foley, engine = rows["Foley and Sugerman 2005"], rows[surveyed.BASE]
    assert engine.rate == 114_499 and find_card("NV25") == engine.card
    arithmetic, bandwidth = scaled.speeds(list(rows.values()))["Foley and Sugerman 2005"]
    assert arithmetic == pytest.approx(foley.rate / 8.32e9 / (114_499 / 2.4e9))
    assert bandwidth == pytest.approx(foley.rate / foley.card.bandwidth
                                      / (114_499 / engine.card.bandwidth))
    # Rates are compared at 10,000 triangles. All scenes of Günther et al. are larger, so the rate
    # in their smallest scene is used: 13.2 frames/s in fairy forest.
    assert rows["Günther et al. 2007"].rate == pytest.approx(13.2 * 1024 ** 2)


def _counts(form: str, issues: int) -> dict[str, Any]:
    """Returns the counts of a cell in which each ray runs one kernel ``issues`` times."""
    issued = {"kernels": ["intersect"], "runs": [480 * issues], "lanes": [480 * issues],
              "iterations": 0, "passes": [0], "queries": 0}
    return {"pixels": 480, "rays": 480, "issued": {form: issued}}


def _conclusions(folder: Path) -> dict[str, float]:
    """Writes the files of Figure 26's cells, and returns each method's time in ns.

    A time is 1000 ns divided by the published speed relative to the Ray Engine. Each
    method without a published speed gets a different made-up speed.
    """
    times = {}
    for at, entry in enumerate(surveyed.entries()):
        speed = surveyed.published_speed(entry.source) or 2.0 + at
        times[entry.label] = 1000 / speed
        _timed(entry, times[entry.label], folder)
        cell = entry.counted()
        if entry.form and cell:
            write_cell(cell, folder, counts=_counts(entry.form, 10_000 + 1000 * at))
        elif cell:
            write_cell(cell, folder, engine={"rays": 480, "pairs": 480 * 100_000, "draws": 1,
                                             "uploaded": 0, "read_back": 0})
        if entry.source:
            write_cell(surveyed.updated(entry), folder, updates={
                "build": 0.5, "update": 0.25, "rebuilt": entry.method.startswith(("kd-", "grid")),
                "size": 2048, "tables": ["triangle", "kd_node"]})
    return times


def test_figure_26_and_table_1_show_the_data(tmp_path: Path) -> None:
    times = _conclusions(tmp_path)
    assert set(fig26.cells(False)) < set(table1.cells(False))
    fig26.draw(tmp_path, tmp_path, False)
    rows = {row["method"]: row for row in _rows(tmp_path / "fig26.csv")}
    assert set(rows) == set(times)
    for label, row in rows.items():
        assert float(row["measured_ns"]) == pytest.approx(times[label])
        assert float(row["measured"]) == pytest.approx(1000 / times[label])
    card, cost = find_card("G80"), static_cost("g80", "kd-restart", "intersect")
    at = [entry.label for entry in surveyed.entries()].index("kd-restart")
    each = max((cost.arithmetic + ASSUMED.branch_instructions) / card.issue_rate,
               (cost.fetches - stream_fetches("kd-restart", "intersect")) / card.texel_rate)
    streams = 2 * card.stream_fetch / card.texel_rate     # the two texels of the ray
    seconds = (10_000 + 1000 * at) * each + streams + ASSUMED.draw_seconds / 480
    assert float(rows["kd-restart"]["predicted_ns"]) == pytest.approx(1e9 * seconds)
    ours, engine = (float(rows[name]["predicted_ns"]) for name in ("kd-restart", "ray-engine"))
    assert float(rows["kd-restart"]["predicted"]) == pytest.approx(engine / ours)
    assert rows["ray-tiles"]["predicted_ns"] == ""     # ray-tiles has no era form (docs/era.md)
    said = fig26.judge(tmp_path, False)
    assert said.renderer is not None and said.scenes == ("tenk",)
    # The faked times have the published ratios, but one scene is too little to judge.
    here = said.renderer
    assert (here.word, here.scenes, here.pairs) == (verdicts.TOO_LITTLE, ("tenk",), here.agreed)
    assert "tau-b is 0.8 or more in 1 of 1 group;" in here.why
    # The predicted times increase from row to row of Table 1. The published times do not.
    assert said.pairs > said.agreed and said.why.startswith("Times predicted for the NVIDIA")
    page = (tmp_path / "fig26.md").read_text()
    assert surveyed.rays_of_columns(False) in page
    assert (tmp_path / "fig26.png").stat().st_size > 10_000

    table1.draw(tmp_path, tmp_path, False)
    lines = {row["source"]: row for row in _rows(tmp_path / "table1.csv")}
    assert set(lines) == set(surveyed.STANDS_FOR)
    horn = lines["Horn et al. 2007"]
    assert (horn["survey_stack"], horn["here_stack"]) == ("Stack-based", "Stack-based")
    assert float(horn["update_seconds"]) == 0.25 and horn["here_dynamic_geometry"] == "N"
    assert float(horn["measured_relative"]) == pytest.approx(40.9)
    said = table1.judge(tmp_path, False)
    assert said.word == verdicts.MOSTLY and said.structure == said.claims > said.held
    assert (said.scenes, "as in Figure 26: too little to judge" in said.why) == (("tenk",), True)
    # Our method for Günther et al. refits, and our Ray Engine has a grid on the host.
    assert "Günther et al. 2007, dynamic geometry: Y, not N" in said.why
    assert "Carr et al. 2002, acceleration structure: Uniform Grid, not N/A" in said.why
    assert surveyed.rays_of_columns(False) in page


@pytest.mark.parametrize("full", [False, True], ids=["quick", "full"])
def test_all_methods_of_a_column_trace_the_same_rays(full: bool) -> None:
    """All methods in a column of Figure 26 and Table 1 trace the same number of rays, and the
    pages name this number."""
    for cells in ([entry.measured(full) for entry in surveyed.entries()],
                  [cell for entry in surveyed.entries() if (cell := entry.counted())]):
        size, = {cell.size for cell in cells}
        scene, = {cell.scene for cell in cells}
        assert f"{size ** 2:,} eye rays ({size}x{size})" in surveyed.rays_of_columns(full)
        assert scene in surveyed.rays_of_columns(full)
        assert all(PERIOD_TEST in cell.options for cell in cells)


def test_the_ray_engine_is_predicted_from_its_pairs() -> None:
    """The card tests each pair of a ray and a triangle once. The bytes of uploads and readbacks
    cross the bus."""
    work = ray_engine_work.measure(load("cornell"), workload("cornell", EYE, 16), {})
    assert work["rays"] == 256 and work["pairs"] >= work["rays"] and work["draws"] >= 1
    card, cost = find_card("G80"), static_cost("g80", "brute-force", "intersect")
    # For each pair, the kernel fetches the ray's two texels from a stream and writes one target.
    each = max(cost.arithmetic / card.issue_rate, 2 * card.stream_fetch / card.texel_rate,
               3 * ASSUMED.texel_bytes / card.bandwidth)
    seconds, bound = ray_engine_work.predicted_seconds(card, work)
    assert seconds == pytest.approx(
        work["pairs"] * each + work["draws"] * ASSUMED.draw_seconds
        + work["uploaded"] / card.upload + work["read_back"] / card.readback)
    slow = {**work, "read_back": 1e12}
    assert ray_engine_work.predicted_seconds(card, slow)[1] == "transfers" != bound


@pytest.mark.parametrize("absent", ["matplotlib", "tqdm"])
def test_without_the_extra_one_line_says_what_to_install(absent: str) -> None:
    code = (f"import sys; sys.modules['{absent}'] = None; import runpy; "
            "runpy.run_module('gpgpu_rt.figures', run_name='__main__')")
    done = subprocess.run([sys.executable, "-c", code], text=True, capture_output=True)
    assert done.returncode == 1 and done.stderr.splitlines() == [
        f"figures: {absent} is not installed; in the checkout's folder, "
        "pip install -e '.[figures]'"]


def test_figure_26_shows_reversed_times_but_one_scene_does_not_judge(tmp_path: Path) -> None:
    for entry in surveyed.entries():
        if entry.source:
            _timed(entry, 1000 * (surveyed.published_speed(entry.source) or 1.0), tmp_path)
    said = fig26.judge(tmp_path, False).renderer
    assert said is not None and (said.word, said.agreed) == (verdicts.TOO_LITTLE, 0)
    assert "(below: all methods -" in said.why


def test_the_cpu_s_rays_a_gflop(tmp_path: Path) -> None:
    """The page divides each rate of rays by the peak arithmetic rate of the threads that traced
    the rays."""
    for column in cpu.columns():
        more = {} if column.threads is None else {"peak": {
            "nominal": 50e9 * column.threads, "attained": 1e9, "fragments": 2e9,
            "model": "M", "clock": 1e9,
            "a_clock": 50, "threads": column.threads, "cores": 1, "clock_is": "a guess"}}
        write_cell(cpu.cell("bunny", column, False), tmp_path, median_ms=1,
                   ns_per_ray=100.0 / (column.threads or 4), **more)
    cpu.draw(tmp_path, tmp_path, False)
    rows = {row["traced_by"]: row for row in _rows(tmp_path / "cpu.csv")}
    one, ours = rows[EMBREE], rows["kd-packet"]
    assert float(one["rays_per_gflop"]) == pytest.approx(1e7 / 50)
    # A CPU renderer ran our method on all threads.
    assert float(ours["rays_per_gflop"]) == pytest.approx(4e7 / (50 * CORES))
    assert float(ours["over_one_thread"]) == pytest.approx(4)
    page = (tmp_path / "cpu.md").read_text()
    assert "1917 Mrays/s" in page  # the survey prints 1,887
    assert "1 GHz (a guess) times 50 operations per clock" in page
    assert f"times the number of cores, which is 1 for {CORES} threads" in page
    assert (tmp_path / one["file"]).exists()


def test_the_nominal_clock_is_the_base_clock_if_known(tmp_path: Path) -> None:
    facts = {"model name": "Some CPU @ 2.20GHz", "cpu MHz": "3512.4"}
    base = tmp_path / "base_frequency"
    assert cpu_peak.clock_of(facts, base)[0] == pytest.approx(2.2e9)
    clock, said = cpu_peak.clock_of({"cpu MHz": "3512.4"}, base)
    assert clock == pytest.approx(3.5124e9) and "when this was measured" in said
    assert cpu_peak.clock_of({}, base) == (None, "not known")
    base.write_text("2400000\n")
    clock, said = cpu_peak.clock_of(facts, base)
    assert clock == pytest.approx(2.4e9) and "cpufreq" in said


def test_threads_of_a_core_count_once() -> None:
    told = [{"physical id": str(chip), "core id": str(core)}
            for chip in range(2) for core in range(3) for _ in range(2)]
    assert cpu_peak.cores_of(told) == 6
    assert cpu_peak.cores_of([{}] * 4) == 0


def test_embree_on_all_threads_is_measured(tmp_path: Path) -> None:
    cell = Cell("cornell", ON_CPU, (("threads", CORES),), 16, runs=1)
    measure.measure([cell], tmp_path)
    found = json.loads((tmp_path / cell.name).read_text())
    assert found["ns_per_ray"] > 0 and found["peak"]["threads"] == CORES
    assert found["peak"]["attained"] > 0 and found["peak"]["fragments"] > 1e6
    assert found["processor_seconds"] > 0


def test_figure_2_shows_recorded_draws(tmp_path: Path) -> None:
    fig02.draw(tmp_path, tmp_path, False)
    whole, quads = fig02.shown()
    assert (whole.primitives, whole.fragments) == (1, fig02.SIDE ** 2)
    assert quads.primitives % 2 == 0 and quads.attributes == {"rectangle": 4, "row": 1}
    assert "triangle_table" not in quads.by_fragments  # the vertex program reads corners
    assert "kd_node_table" in whole.by_fragments
    rows = {row["method"]: row for row in _rows(tmp_path / "fig02.csv")}
    assert rows["kd-restart"]["rasteriser"].startswith("1 triangle in")
    assert f"{quads.fragments} fragments" in rows["ray-engine"]["frame buffer"]
    assert (tmp_path / "fig02.png").stat().st_size > 10_000


def test_a_small_comparison_traces_back_to_its_cells(tmp_path: Path, monkeypatch) -> None:
    """A small figure is measured, drawn and indexed. All its numbers are in the cells' files."""
    small = replace(
        fig12.FIGURE, panels=(Panel("cornell"),), remarks=lambda results: [], paper_card=None,
        asked=lambda panel, column, full: Cell(panel.scene, column.method, (), 8, runs=1))
    for module in (pages, command):
        monkeypatch.setattr(module, "figure_of", lambda name: small)
    data, out = tmp_path / "data", tmp_path / "out"
    assert command.main(["--only", "fig12", "--data", str(data), "--out", str(out)]) == 0
    held = json.loads((out / "fig12.json").read_text())
    assert len(held["cells"]) == len(small.columns) == len(held["rows"])
    for cell, row in zip(held["cells"], held["rows"]):
        file = json.loads((data / cell["file"]).read_text())
        assert float(row["ns_per_ray"]) == file["ns_per_ray"]
        assert cell["renderer"] == file["gpu"]["renderer"] and cell["commit"] == file["commit"]
        assert cell["settings"] == file["settings"] and cell["settings"]["size"] == 8
    index, page = ((out / f"{name}.md").read_text() for name in ("index", "fig12"))
    said = small.judge(data, False)
    assert (f"**{said.word}** | {verdicts.rests_on(said)} | {said.why}" in index
            and "[JSON](fig12.json)" in index)
    assert said.word in (out / "index.html").read_text()
    assert page.startswith(f"# {small.title}\n\n**{said.word}**: {said.why}\n\nThe verdict rests "
                           f"on {verdicts.rests_on(said)}.\n\n")
    assert of_page("fig12")[0] in page and "Where the survey contradicts itself" in page
    assert f"## Works\n\n* {find_work('Foley and Sugerman 2005')}.\n" in page


def test_seconds_spent_are_summed_over_cells(tmp_path: Path) -> None:
    cells = [Cell("shirley6", "kd-ropes", (("max_depth", depth),), 0, "tree") for depth in (2, 3)]
    measure.measure(cells, tmp_path)
    found = [json.loads((tmp_path / cell.name).read_text()) for cell in cells]
    assert [one["tree"]["leaves"] for one in found] == sorted(
        {one["tree"]["leaves"] for one in found})

    def spent() -> tuple[float, int]:  # count a cell once, even if two pages use it
        for name in ("fig02", "fig03"):
            (tmp_path / f"{name}.md").write_text(name)
            provenance.record(name, cells, tmp_path, tmp_path, False)
        return provenance.spent(filter(None, (
            provenance.held(name, tmp_path) for name in ("fig02", "fig03", "fig04"))))
    seconds, unknown = spent()
    assert seconds == pytest.approx(math.fsum(one["processor_seconds"] for one in found))
    assert unknown == 0
    old = {name: value for name, value in found[0].items() if name != "processor_seconds"}
    (tmp_path / cells[0].name).write_text(json.dumps({**old, "seconds_spent": 1e6}))
    assert spent() == (found[1]["processor_seconds"], 1)


def test_drawing_a_page_changes_no_other_page(tmp_path: Path, monkeypatch) -> None:
    """The index says which pages have measurements of another size (quick or full)."""
    sizes = {False: 8, True: 12}
    small = replace(
        fig12.FIGURE, panels=(Panel("cornell"),), remarks=lambda results: [], paper_card=None,
        asked=lambda panel, column, full: Cell(panel.scene, column.method, (), sizes[full],
                                               runs=1))
    for module in (pages, command):
        monkeypatch.setattr(module, "figure_of", lambda name: replace(small, name=name))
    out = tmp_path / "out"
    words = ["--data", str(tmp_path / "data"), "--out", str(out), "--only"]
    assert command.main([*words, "fig12", "--full"]) == 0
    before = (out / "fig12.json").read_text()
    assert command.main([*words, "fig13"]) == 0
    assert (out / "fig12.json").read_text() == before
    assert [json.loads((out / f"{name}.json").read_text())["cells"][0]["settings"]["size"]
            for name in ("fig12", "fig13")] == [12, 8]
    index = (out / "index.md").read_text()
    assert json.loads(before)["verdict"]["why"] in index
    assert "Size of the measurements: the papers', but quick for fig13." in index


def test_provenance_of_a_figure_without_measurements(tmp_path: Path) -> None:
    (tmp_path / "fig02.md").write_text("a page")
    assert provenance.held("fig02", tmp_path) is None
    provenance.record("fig02", [], tmp_path, tmp_path, False, verdicts.DIAGRAM)
    held = provenance.held("fig02", tmp_path)
    assert held["cells"] == [] and held["drawn"]["renderer"]
    assert held["verdict"]["word"] == verdicts.REDRAWN
    assert "drawn from observed passes" in provenance.summary(held)


def test_contradictions_quote_published_numbers() -> None:
    says = " ".join(one.says for one in CONTRADICTIONS)
    cornell = [published("fig13", "cornell", *more) for more in (
        ("kd-packet", "push_down=False stack_size=0", "primary"), ("kd-restart", "", "primary"),
        ("kd-restart", "", "shadow"), ("kd-packet", "push_down=False stack_size=0", "shadow"),
        ("kd-packet", "push_down=True stack_size=0", "primary"))]
    grids = [published(figure, "robots", "grid") for figure in ("fig12", "fig20")]
    assert all(f"{value:g}" in says for value in (*cornell, *grids))


def test_contradictions_name_existing_figures_and_tables() -> None:
    assert len(CONTRADICTIONS) == 16
    of_survey = {name for one in CONTRADICTIONS for name in one.pages
                 if name.startswith(("fig", "table"))}
    assert of_survey <= set(FIGURES)
