"""The page of the machine model shows the times that follow from the counted kernel runs. The page
also names the accuracy targets ("bars") that the model misses."""
from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest
from faked_cells import write_cell

import gpgpu_rt as rt
from gpgpu_rt.bench.workloads import EYE, workload
from gpgpu_rt.figures.experiments import era_machine
from gpgpu_rt.figures.experiments.era_machine_page import _view, bars, by_method, far_off
from gpgpu_rt.figures.framework import predicted_times
from gpgpu_rt.figures.framework.output import number
from gpgpu_rt.figures.survey import fig12_eye_rays as fig12
from gpgpu_rt.figures.survey import fig13_horn_improvements as fig13
from gpgpu_rt.figures.survey import fig16_ropes_and_packets as fig16
from gpgpu_rt.figures.survey import fig20_whole_images as fig20
from gpgpu_rt.hardware import image_issues, program_forms
from gpgpu_rt.hardware.cards import find_card
from gpgpu_rt.hardware.issue import STEP, WHILE_WHILE
from gpgpu_rt.hardware.machine_model import ASSUMED
from gpgpu_rt.hardware.static_costs import static_cost
from gpgpu_rt.scene.loading import load_scene

PIXELS, RUNS = 1000, 400_000


def _counts(kernels: Sequence[str] = ("down", "intersect")) -> dict:
    """Returns a cell's counts. The first kernel has RUNS runs. These runs occupy 2 * RUNS lanes,
    so half of the lanes wait."""
    issued = {"kernels": list(kernels), "runs": [RUNS, 0], "lanes": [2 * RUNS, 0],
              "iterations": 0, "passes": [0, 0], "queries": 0}
    return {"pixels": PIXELS, "rays": PIXELS / 2, "issued": {
        form: issued for form in (WHILE_WHILE, STEP, program_forms.PASSES)}}


def _write(data: Path) -> None:
    for cell in predicted_times.cells(fig13.FIGURE, False):
        if (cell.scene, cell.method) == ("cornell", "kd-restart"):
            write_cell(cell, data, counts=_counts())


def test_the_table_follows_from_the_counts(tmp_path: Path) -> None:
    _write(tmp_path)
    era_machine.draw(tmp_path, tmp_path, full=False)
    with (tmp_path / "era_machine.csv").open() as file:
        rows = {(row["scene"], row["form"]): row for row in csv.DictReader(file)}
    assert len(rows) == 6
    card, cost = find_card("R580"), static_cost("r580", "kd-restart", "down", in_loop=True)
    # In a loop, a run of `down` fetches only a node. As a pass, `down` would also fetch the ray,
    # its state and its hit. Branches take no time here, because a separate unit executes them.
    each = max(cost.arithmetic / card.issue_rate, 1 / card.texel_rate)
    # Fetching the two texels of the ray takes longer than the instructions of `init`, and longer
    # than writing the hit.
    ray = 2 * card.stream_fetch / card.texel_rate
    assert ray > max(static_cost("r580", "kd-restart", "init").arithmetic / card.issue_rate,
                     3 * ASSUMED.texel_bytes / card.bandwidth)
    seconds = 2 * RUNS * each + PIXELS * ray + ASSUMED.draw_seconds
    primary, shadow = (next(row for (scene, form), row in rows.items()
                            if rays in scene and form == WHILE_WHILE)
                       for rays in ("primary", "shadow"))
    assert float(primary["predicted_ns"]) == pytest.approx(1e9 * seconds / PIXELS)
    assert float(shadow["predicted_ns"]) == pytest.approx(2e9 * seconds / PIXELS)
    assert float(primary["published_ns"]) == pytest.approx(1e3 / 38.3)
    assert {row["form"] for row in rows.values() if row["scored"] == "True"} == {WHILE_WHILE}
    page = (tmp_path / "era_machine.md").read_text()
    assert "paper's images: 1024x1024 pixels in fig13.\n" in page
    assert "draw_seconds doubled" in page and "missed by" in page
    assert "`gpgpu-rt scenes --fetch`" in page
    assert (tmp_path / "era_machine.png").stat().st_size > 5_000


def test_a_prediction_that_is_far_off_names_its_instructions(tmp_path: Path) -> None:
    _write(tmp_path)
    rows = [row for row in era_machine.rows(tmp_path, False) if row.form == WHILE_WHILE]
    card = find_card("R580")
    cost = static_cost("r580", "kd-restart", "down", in_loop=True).arithmetic
    primary = next(row for row in rows if row.panel.rays == "primary")
    assert (primary.per, primary.runs, primary.instructions) == ("a ray", RUNS / PIXELS, cost)
    assert primary.issued_instructions == 2 * cost
    # The published 38.3 million rays per second allow this many instructions per kernel run.
    assert primary.allowed == pytest.approx(card.issue_rate / 38.3e6 / (RUNS / PIXELS))
    said = far_off(rows)
    assert len(said) == len(rows) == 2 and "kd-restart: predicted" in said[0]
    assert (f"the compiled kernels take {cost}, and waiting lanes raise this to {2 * cost}"
            in said[0])


def test_each_part_of_the_rows_has_its_own_median(tmp_path: Path) -> None:
    _write(tmp_path)
    rows = era_machine.rows(tmp_path, False)
    primary, shadow = (row for row in rows if row.scored)
    # The published data of cornell give a view, but no light for shadow rays.
    assert primary.published_view and not shadow.published_view
    assert (_view(primary), _view(shadow)) == ("published", "published; light chosen")
    published, chosen, possible = era_machine.parts(rows).values()
    assert published == (1, pytest.approx(abs(math.log2(primary.ratio()))))
    assert chosen == (1, pytest.approx(abs(math.log2(shadow.ratio()))))
    assert possible == (2, pytest.approx(era_machine.median_miss(rows)))
    (group,) = by_method(rows)
    logs = sorted(math.log2(row.ratio()) for row in (primary, shadow))
    assert group == ("fig13", "R580", "kd-restart", WHILE_WHILE, 2,
                     *map(number, (sum(logs) / 2, *logs)))


@dataclass(frozen=True)
class _Row:
    """A substitute for a scored row of the page."""

    group: tuple[str, str]
    published: float
    predicted: float
    scored: bool = True

    def nanoseconds(self, assumed: object) -> float:
        return self.predicted


def test_scenes_without_a_published_order_have_no_tau() -> None:
    rows = [_Row(("a", "x"), 1, 1), _Row(("a", "x"), 2, 3),     # in order
            _Row(("a", "y"), 57, 1), _Row(("a", "y"), 59, 2),   # published times that tie
            _Row(("b", "x"), 1, 1)]
    assert era_machine.orders(rows) == {("a", "x"): 1.0}


def test_times_too_short_for_the_triangle_tests_are_ruled_out(tmp_path: Path) -> None:
    """A triangle test needs at least three instructions. The published time allows 2.1
    instructions per test on the bunny, and 23 on cornell."""
    triangles = {"cornell": 32, "bunny": 69_451}
    for panel, column, cells in predicted_times.pairs(fig12.FIGURE, False):
        if column.method == "brute-force" and panel.scene in triangles:
            (cell,) = cells.values()
            tests = PIXELS * triangles[panel.scene]
            write_cell(cell, tmp_path, counts={
                "pixels": PIXELS, "rays": PIXELS, "issued": {program_forms.PASSES: {
                    "kernels": ["intersect"], "runs": [tests], "lanes": [tests],
                    "iterations": 0, "passes": [1], "queries": 0}}})
    found = {row.panel.scene: row.ruled_out for row in era_machine.rows(tmp_path, False)}
    assert found == {"cornell": False, "bunny": True}


def test_a_form_that_was_not_counted_has_no_row(tmp_path: Path) -> None:
    for figure in (fig16.FIGURE, fig20.FIGURE):
        for panel, column, cells in predicted_times.pairs(figure, False):
            if (panel.scene, column.method) in (("bunny", "kd-ropes"), ("cornell", "grid")):
                for cell in cells.values():
                    write_cell(cell, tmp_path, counts=_counts(
                        ["follow_rope", "down"] if figure is fig16.FIGURE else
                        ["traverse", "intersect"]))
    forms: dict[str, dict[str, float]] = {}
    for row in era_machine.rows(tmp_path, False):
        forms.setdefault(row.column.method, {})[row.form] = row.nanoseconds()
    assert set(forms["grid"]) == {STEP, WHILE_WHILE, program_forms.PASSES}
    assert set(forms["kd-ropes"]) == {WHILE_WHILE, STEP, program_forms.UNCOALESCED}
    cached, alike, past = (forms["kd-ropes"][name] for name in (
        WHILE_WHILE, STEP, program_forms.UNCOALESCED))
    # Half of the lanes wait. In the form UNCOALESCED, loads bypass the texture units, and waiting
    # lanes load nothing. This form therefore takes less time.
    assert cached == alike and past < 0.9 * cached


def test_a_missed_bar_is_named_with_its_distance() -> None:
    said = bars({"as stated": 0.5, "a halved": 0.4, "a doubled": 0.55},
                {("fig20", "robots"): 0.2, ("fig20", "bunny"): 1.0})
    assert "0.32: missed by 0.18" in said[0] and said[1].endswith("0.6: met.")
    assert "1 of 2 scenes: missed in fig20 robots (0.2)" in said[2]


def test_all_forms_of_a_program_have_the_same_runs() -> None:
    """All three forms of a program have the same kernel runs. The form with passes also has counts
    of passes."""
    scene = load_scene("cornell")
    found = image_issues.measure(scene, workload("cornell", EYE, 256), "bvh-threaded", {}, "G80")
    assert found["pixels"] == 256 * 256
    runs = {form: issued["runs"] for form, issued in found["issued"].items()}
    assert len(set(map(tuple, runs.values()))) == 1 and len(runs) == 3
    loop, passes = (found["issued"][form] for form in (WHILE_WHILE, program_forms.PASSES))
    assert all(lanes >= ran for lanes, ran in zip(loop["lanes"], loop["runs"]))
    assert sum(passes["passes"]) > 0 and not loop["passes"]


def test_runs_of_lanes_follow_from_their_packet() -> None:
    """The kernel runs of a lane follow from the counters of the lane's packet."""
    scene, size = load_scene("cornell"), 192     # the counted tiles cover the image
    found = image_issues.measure(scene, workload("cornell", EYE, size), "bvh-packet", {}, "G80")
    issued = found["issued"][program_forms.PACKETS]
    with rt.Tracer(scene, "bvh-packet", statistics=True, packet=image_issues.WARP_PACKET,
                   intersection="moller-trumbore") as tracer:
        hits = tracer.trace(*scene.camera.rays((size, size)))
    # Each ray of a packet stores two counts: the nodes that the packet visits, and the triangle
    # tests of all 16 rays together. `traverse` runs twice for a node, once for each child's box.
    assert issued["kernels"] == ("traverse", "intersect")
    assert issued["runs"] == (2 * hits.nodes_visited.sum(), hits.triangles_tested.sum() / 16)
    # The two packets of a warp have some nodes and triangles in common, but not all.
    for runs, lanes in zip(issued["runs"], issued["lanes"]):
        assert runs < lanes < 1.9 * runs
    assert program_forms.forms_of("bvh-packet", "R580") == ()


def test_a_fragment_of_a_card_with_branches_traces_a_packet() -> None:
    scene, size = load_scene("cornell"), 192     # the counted tiles cover the image
    options = {"push_down": True, "stack_size": 3, "skip_empty_leaves": False}
    found = image_issues.measure(scene, workload("cornell", EYE, size), "kd-packet", options,
                                 "R580")
    assert list(found["issued"]) == [WHILE_WHILE, STEP]
    assert (found["pixels"], found["rays"]) == (size * size, size * size)
    with rt.Tracer(scene, "kd-packet", statistics=True, intersection="moller-trumbore",
                   **options) as tracer:
        hits = tracer.trace(*scene.camera.rays((size, size)))
    for issued in found["issued"].values():
        runs, lanes = (dict(zip(issued["kernels"], issued[name])) for name in ("runs", "lanes"))
        # Each ray of a packet stores the packet's count of nodes.
        assert runs["traverse"] == pytest.approx(hits.nodes_visited.sum() / 4, rel=0.03)
        assert size * size / 5 < runs["begin"] <= size * size / 4   # some rays miss the box
        assert runs["pop"] >= runs["push"] / 2 > 0
        assert all(lanes[name] >= runs[name] for name in runs)
    assert program_forms.forms_of("kd-packet", "R420") == ()
    assert program_forms.forms_of("kd-packet", "G80") == (program_forms.PACKETS,)


def test_brute_force_tests_every_triangle() -> None:
    scene = load_scene("cornell")
    found = image_issues.measure(scene, workload("cornell", EYE, 64), "brute-force", {}, "R420")
    assert found["issued"][program_forms.PASSES]["runs"] == (64 * 64 * len(scene),)
