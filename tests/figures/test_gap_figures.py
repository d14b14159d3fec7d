"""The pages of the experiments on sections 4.3 and 5 show the numbers of their data."""
from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pytest

import gpgpu_rt as rt
from gpgpu_rt.bench.workloads import EYE, workload
from gpgpu_rt.figures.experiments import gap_work, ideal_hardware, retention, simd_width, stacks
from gpgpu_rt.figures.framework import results
from gpgpu_rt.figures.framework.cell import Cell
from gpgpu_rt.hardware.machines import machines


def _keep(data: Path, cell: Cell, gap: dict[str, Any]) -> None:
    (data / cell.name).write_text(json.dumps({
        "settings": results.settings(cell), "gap": gap, "commit": "none",
        "gpu": {"renderer": "none"}, "scene": {"stand_in": None}}))


def _page(module: Any, tmp_path: Path) -> list[dict[str, str]]:
    module.draw(tmp_path, tmp_path, False)
    name = module.__name__.rpartition(".")[2]
    assert (tmp_path / f"{name}.png").stat().st_size > 10_000
    assert (tmp_path / f"{name}.md").read_text().startswith("# ")
    with (tmp_path / f"{name}.csv").open() as file:
        return list(csv.DictReader(file))


def _done(instructions: int, turns: int) -> dict[str, Any]:
    """Returns the recorded work of 32 rays, in a loop that runs ``turns`` times for each ray.

    The number of runs is the same at each width, so utilisation halves when the width doubles.
    """
    return {"count": 32, "fragments": 32, "kernels": ["", "down", "intersect"],
            "written_bytes": 0, "texel_bytes": {}, "fetched": 0,
            "transfers": {f"{store} {line} {together}": 100 for store in gap_work.STORES
                          for line in gap_work.LINES for together in gap_work.TOGETHER},
            "regions": [{"vector": cost, "scalar": 2 * cost, "parent": at - 1, "loop": at > 0,
                         "fetches": {"kd_node_table": 1} if at else {},
                         "runs": {str(w): 32 * (turns if at else 1) for w in gap_work.WIDTHS}}
                        for at, cost in enumerate((0, instructions, 0))]}


def test_bytes_moved_are_those_of_the_log(tmp_path: Path) -> None:
    for cell in retention.cells(False):
        kernels = dict(cell.options)["schedule"] == "kernels"
        _keep(tmp_path, cell, {
            "count": 100, "draws": 1, "queries": 0, "fragments": 100, "bytes": {
                "rays": 3200, "state": 8000 if kernels else 0, "written": 4000}})
    rows = _page(retention, tmp_path)
    assert len(rows) == 12
    for row in rows:
        most = row["schedule"] == "kernels"
        assert float(row["bytes a ray"]) == (152 if most else 72)
        assert float(row["bytes / bytes of loop"]) == pytest.approx(152 / 72 if most else 1)
    assert "moves 2.11 times the bytes of `loop`" in (tmp_path / "retention.md").read_text()


def test_a_ray_s_bytes_are_those_of_its_records() -> None:
    # A ray has eight numbers and its hit has four. A kd-tree's state has interval, node, cursor,
    # phase and steps. A BVH's state has node, cursor and stack height.
    assert (stacks.NODE, stacks.KD_ENTRY) == (4, 8)
    assert stacks.state_bytes("bvh-stack") == 4 * (8 + 4 + 3)
    plain = stacks.state_bytes("kd-restart")
    assert plain == stacks.state_bytes("kd-stack")
    assert stacks.state_bytes("kd-push-down") == plain + 4 * 2
    assert stacks.state_bytes("kd-short-stack") == plain + 4 * 3  # without the stack itself


def test_schedules_of_a_scene_differ_in_what_they_move() -> None:
    rays = workload("cornell", EYE, 32)
    moved = {schedule: gap_work.measure(gap_work.MOVED, rt.load_scene("cornell"), rays,
                                        "kd-restart", {"schedule": schedule})
             for schedule in ("kernels", "loop")}
    alone = moved["loop"]["bytes"]
    # Camera rays share one origin, which is a uniform. The only pass reads directions and writes
    # hits; states stay in registers.
    assert alone == {"rays": 16 * 1024, "state": 0, "written": 16 * 1024}
    for part in ("rays", "state", "written"):
        assert moved["kernels"]["bytes"][part] > 3 * alone[part]


def test_utilisation_is_what_lanes_do_over_what_they_wait(tmp_path: Path) -> None:
    for cell in simd_width.cells(False):
        _keep(tmp_path, cell, _done(40 if cell.method == "bvh-stack" else 10, 5))
    rows = _page(simd_width, tmp_path)
    for row in rows:
        width = int(row["width"])
        assert float(row["utilisation"]) == pytest.approx(1 / width)
        cost = 40 if row["method"] == "bvh-stack" else 10
        assert float(row["instructions a ray"]) == pytest.approx(width * 5 * cost)


def test_stacks_leave_rays_in_flight_that_fit(tmp_path: Path) -> None:
    for cell in stacks.cells(False):
        deep = cell.work.startswith(gap_work.STACKS)
        _keep(tmp_path, cell, {"levels": 32, "histogram": [0, 5, 2]} if deep else _done(10, 5))
    rows = {row["method"]: row for row in _page(stacks, tmp_path)}
    card = machines()["G80"]
    assert int(rows["kd-stack"]["bytes of stack"]) == 256
    assert int(rows["kd-stack"]["rays in flight"]) == 64  # the survey's number
    assert int(rows["kd-stack"]["deepest seen"]) == 2
    kept = int(rows["kd-restart"]["bytes a ray in registers"])
    assert kept == 4 * (8 + 4 + 8)
    assert int(rows["kd-restart"]["rays in flight"]) == card.registers // kept // 32 * 32
    # A warp runs the loop 32 x 5 times. Each iteration costs 20 scalar instructions and a fetch,
    # and its inner region costs another fetch.
    clocks = 4 * 32 * 5 * 20 + card.fetch_latency * 32 * 10
    assert float(rows["kd-stack"]["Mrays/s"]) == pytest.approx(
        1e-6 * card.multiprocessors * 64 * card.clock / clocks)


def test_units_are_as_fast_as_their_figures_allow(tmp_path: Path) -> None:
    for cell in ideal_hardware.cells(False):
        _keep(tmp_path, cell, _done(10, 5))
    rows = _page(ideal_hardware, tmp_path)
    ideal = machines()["ideal"]
    both = next(row for row in rows if row["machine"] == "G80 and both")
    assert float(both["steps ns"]) == pytest.approx(
        1e9 * 5 / (ideal.units * ideal.clock * ideal.steps))
    assert "Cell, transfers hidden" in {row["machine"] for row in rows}
    assert "from memory" in (tmp_path / "ideal_hardware.md").read_text()
