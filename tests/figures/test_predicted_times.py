"""If a paper's times are from a card, the figure is judged by times predicted for this card."""
from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from faked_cells import write_cell

from gpgpu_rt.figures.framework import comparison, pages, predicted_times, provenance, verdicts
from gpgpu_rt.figures.framework.cell import Cell
from gpgpu_rt.figures.framework.comparison import Comparison, Panel
from gpgpu_rt.figures.framework.published_numbers import nanoseconds
from gpgpu_rt.figures.survey import fig12_eye_rays as fig12
from gpgpu_rt.figures.survey import fig13_horn_improvements as fig13
from gpgpu_rt.figures.survey import fig20_whole_images as fig20
from gpgpu_rt.hardware.issue import STEP, WHILE_WHILE
from gpgpu_rt.hardware.program_forms import PASSES
from gpgpu_rt.hardware.static_costs import static_cost

COUNTERS = {"nodes_visited": 1.0, "triangles_tested": 1.0, "steps": 2.0}
SCENES = ("robots", "kitchen")
STAND_IN = {"triangles": 10_000, "stand_in": "a mesh"}


def _cells(figure: Comparison) -> list[Cell]:
    """Returns the cells that count kernel runs, even if the scenes' meshes are missing."""
    return [cell for _, _, some in predicted_times.pairs(figure, False) for cell in some.values()]


def _write(data: Path, reverse: bool = False, **scene: object) -> None:
    """Writes the cells of Figure 12. The times predicted from the counts have the published
    order, and the measured times have the reverse order. With ``reverse``, the predicted times
    have the reverse order, and the measured times have the published order."""
    figure = fig12.FIGURE
    assert figure.paper_card is not None
    for name in SCENES:
        for column in figure.columns:
            panel = Panel(name)
            published = nanoseconds(figure.published_row(panel, column))
            assert published is not None
            predicted, measured = (1e6 / published, published) if reverse else (
                published, 1e6 / published)
            write_cell(figure.cell(panel, column, False), data, ns_per_ray=measured,
                       median_ms=1.0, samples_ms=[1.0], counters=COUNTERS, **scene)
            runs = round(1000 * predicted)
            issued = {"kernels": ["intersect"], "runs": [runs], "lanes": [runs], "iterations": 0,
                      "passes": [0], "queries": 0}
            for cell in _cells(figure):
                if (cell.scene, cell.method) == (name, column.method):
                    write_cell(cell, data, counts={"pixels": 100, "rays": 100,
                                                   "issued": {PASSES: issued}}, **scene)


@pytest.mark.parametrize("reverse", [False, True])
def test_times_predicted_for_the_card_decide_the_verdict(reverse: bool, tmp_path: Path) -> None:
    _write(tmp_path, reverse)
    said = fig12.FIGURE.judge(tmp_path, False)
    assert said.renderer is not None and said.scenes == said.renderer.scenes == SCENES
    card, here = (one.word == verdicts.CONTRADICTED for one in (said, said.renderer))
    assert (card, here) == (reverse, not reverse)
    assert said.why.startswith("Times predicted for the ATI Radeon X800 XT PE: ")
    pages.draw(["fig12"], tmp_path, tmp_path, False)
    page = (tmp_path / "fig12.md").read_text()
    assert "X800 XT PE would have taken for 512x512 pixels, " in page
    assert page.count(f'times of the present renderer is "{said.renderer.word}"') == 1
    assert ("tau-b predicted -1, tau-b here 1" if reverse
            else "tau-b predicted 1, tau-b here -1") in page
    assert ("Where the predicted order differs" in page) == reverse
    assert ("Where the order differs here" in page) != reverse
    held = provenance.held("fig12", tmp_path)
    assert held is not None and verdicts.Verdict.from_json(held["verdict"]) == said
    for row in held["rows"]:
        assert float(row["predicted_ns_per_ray"]) > 0


def test_the_legend_covers_all_panels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The last panel shows a stand-in, without predicted times. The legend still has the mark of
    predicted times, and says that stand-ins have none."""
    figure, charts = fig12.FIGURE, []
    _write(tmp_path)
    last = [panel for panel, _ in figure.pairs(False) if panel.scene in SCENES][-1]
    for cell in _cells(figure):
        if cell.scene == last.scene:
            (tmp_path / cell.name).unlink(missing_ok=True)
    for column in figure.columns:
        write_cell(figure.cell(last, column, False), tmp_path, ns_per_ray=1.0, median_ms=1.0,
                   samples_ms=[1.0], counters=COUNTERS, scene=STAND_IN)
    monkeypatch.setattr(comparison, "save_chart", lambda chart, *_: charts.append(chart))
    figure.draw(tmp_path, tmp_path, False)
    legend = charts[0].legends[0]
    assert [text.get_text() for text in legend.get_texts()] == [
        "published", "predicted for the paper's card; none for stand-ins", "measured here"]


def test_stand_ins_are_not_scored_on_a_card_either(tmp_path: Path) -> None:
    _write(tmp_path, scene=STAND_IN)
    said = fig12.FIGURE.judge(tmp_path, False)
    assert (said.word, said.scenes) == (verdicts.TOO_LITTLE, ())
    assert said.stand_ins is not None and said.stand_ins.scenes == SCENES


def test_without_predictions_the_verdict_says_which_methods_lack_them(tmp_path: Path) -> None:
    assert fig13.FIGURE.paper_card is not None
    without_branches = replace(fig13.FIGURE.paper_card, chip="R420")
    figure = replace(fig13.FIGURE, paper_card=without_branches)
    for panel in figure.panels:
        for column in figure.columns:
            write_cell(figure.cell(panel, column, False), tmp_path, ns_per_ray=1.0, median_ms=1.0)
    said = figure.judge(tmp_path, False)
    assert said.word == verdicts.TOO_LITTLE and said.renderer is not None
    assert "has no packets on this card: packets, + push-down, + short stack." in said.why
    assert "empty leaves skipped" not in said.why     # the paper has no such row
    assert "No time is predicted" not in fig13.FIGURE.judge(tmp_path, False).why


def test_each_improvement_of_packets_has_its_own_kernels(tmp_path: Path) -> None:
    """All rows have the same kernel runs, so only the compiled kernels make the times differ."""
    kernels = ("traverse", "intersect", "leave", "begin", "pop")
    issued = {"kernels": kernels, "runs": [5000] * 5, "lanes": [6000] * 5, "iterations": 0,
              "passes": [0] * 5, "queries": 0}
    forms = (WHILE_WHILE, STEP)
    for cell in _cells(fig13.FIGURE):
        if (cell.scene, cell.method) == ("cornell", "kd-packet"):
            write_cell(cell, tmp_path, counts={"pixels": 400, "rays": 400,
                                               "issued": dict.fromkeys(forms, issued)})
    rows = [row for row in predicted_times.rows(fig13.FIGURE, tmp_path, False)
            if row.panel.rays == "primary"]
    assert [row.column.label for row in rows if row.judged] == list(fig13.LABELS[1:])
    assert [row.form for row in rows if row.judged] == [WHILE_WHILE] * 3
    for row in rows:
        costs = [static_cost("r580", "kd-packet", name, in_loop=True, **dict(row.column.options))
                 for name in kernels]
        assert row.instructions == pytest.approx(sum(one.arithmetic for one in costs) / 5)
        assert row.runs == 5000 * 5 / 400      # a packet runs a kernel once for four rays
    plain, down, short = (row.nanoseconds() for row in rows if row.judged)
    assert plain < down < short


def test_a_picture_s_time_is_that_of_eye_and_shadow_rays(tmp_path: Path) -> None:
    cells = [cell for cell in _cells(fig20.FIGURE)
             if (cell.scene, cell.method) == ("cornell", "grid")]
    assert len(cells) == 2
    issued = {"kernels": ["intersect"], "runs": [7000], "lanes": [7000], "iterations": 0,
              "passes": [0], "queries": 0}
    forms = fig20.FIGURE.paper_card.forms
    for cell in cells:
        write_cell(cell, tmp_path, counts={"pixels": 100, "rays": 100,
                                           "issued": dict.fromkeys(forms, issued)})
    rows = predicted_times.rows(fig20.FIGURE, tmp_path, False)
    assert [row.form for row in rows] == list(forms)
    assert [row.judged for row in rows] == [True, False, False, False]
    row = rows[0]
    parts = [predicted_times.time_of_image(row.paper_card.card, "grid", row.form, counts, any_hit)
             for any_hit, counts in zip((False, True), row.counts.values())]
    assert row.nanoseconds() == pytest.approx(1e7 * sum(one.seconds for one in parts))
    assert parts[0].seconds != parts[1].seconds     # the any-hit kernel has other instructions


def test_nothing_is_counted_on_stand_ins(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(predicted_times, "mesh_path", lambda scene: None)
    assert {cell.scene for cell in predicted_times.cells(fig12.FIGURE, False)} == {"cornell"}
    monkeypatch.setattr(predicted_times, "mesh_path", lambda scene: Path(scene))
    assert len(predicted_times.cells(fig12.FIGURE, False)) == 16
