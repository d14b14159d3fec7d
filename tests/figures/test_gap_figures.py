"""The pages of the experiments on the survey's sections 4.3 and 5 show the numbers of the result
files."""
from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.bench.workloads import EYE, workload
from gpgpu_rt.figures.experiments import gap_work, ideal_hardware, retention, simd_width, stacks
from gpgpu_rt.figures.experiments.coherence import observe_order
from gpgpu_rt.figures.framework import results
from gpgpu_rt.figures.framework.cell import Cell
from gpgpu_rt.figures.framework.output import number
from gpgpu_rt.hardware.image_issues import STEPWISE, tile_pixels
from gpgpu_rt.hardware.issue import WHILE_WHILE, WITHIN, issued_in_loop
from gpgpu_rt.hardware.machines import machines
from gpgpu_rt.hardware.static_costs import static_cost
from gpgpu_rt.hardware.trace import record_trace


def _keep(data: Path, cell: Cell, gap: dict[str, Any]) -> None:
    """Writes the file of a cell (framework/cell.py) as if ``gap`` were its measured result."""
    (data / cell.name).write_text(json.dumps({
        "settings": results.settings(cell), "gap": gap, "commit": "none",
        "gpu": {"renderer": "none"}, "scene": {"stand_in": None}}))


def _page(module: Any, tmp_path: Path) -> list[dict[str, str]]:
    """Draws the page and the chart of an experiment; returns the rows of its CSV file."""
    module.draw(tmp_path, tmp_path, False)
    name = module.__name__.rpartition(".")[2]
    assert (tmp_path / f"{name}.png").stat().st_size > 10_000
    assert (tmp_path / f"{name}.md").read_text().startswith("# ")
    with (tmp_path / f"{name}.csv").open() as file:
        return list(csv.DictReader(file))


def _done(cell: Cell, visits: int, tests: int = 0) -> dict[str, Any]:
    """Returns the recorded work of 32 rays, each with ``visits`` visits and ``tests`` tests.

    In a method with a deep stack, each ray also pushes once. At every SIMD width, the number of
    issues is the same, so the utilisation of lanes halves when the width doubles.
    """
    names = ("traverse" if cell.method.startswith("bvh") or "packet" in cell.method else "down",
             "intersect", "push")
    each = dict(zip(names, (visits, tests, int(cell.method in ("kd-texture-stack", "bvh-stack")))))
    return {"count": 32, "runs": {name: 32 * count for name, count in each.items() if count},
            "lanes": {str(width): {name: 32 * width * count for name, count in each.items()
                                   if count} for width in gap_work.WIDTHS},
            "transfers": {f"{store} {line} {together}": 100 for store in gap_work.STORES
                          for line in gap_work.LINES for together in gap_work.TOGETHER}}


def test_the_page_shows_the_logged_bytes(tmp_path: Path) -> None:
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


def test_a_ray_s_state_has_the_bytes_of_its_records() -> None:
    # A ray has 8 numbers, its inverse direction has 3 numbers, and its hit has 4 numbers. The
    # state for a kd-tree has t_min, t_max, t_exit, node, cursor, end, phase and steps. The state
    # for a BVH has node, cursor and stack height.
    assert (stacks.NODE, stacks.KD_ENTRY) == (4, 8)
    assert stacks.state_bytes("bvh-stack") == 4 * (8 + 3 + 4 + 3)
    plain = stacks.state_bytes("kd-restart")
    assert plain == stacks.state_bytes("kd-stack")
    assert stacks.state_bytes("kd-push-down") == plain + 4 * 2
    assert stacks.state_bytes("kd-short-stack") == plain + 4 * 3  # without the stack itself


def test_kernels_moves_more_bytes_than_loop() -> None:
    rays = workload("cornell", EYE, 32)
    moved = {schedule: gap_work.measure(gap_work.MOVED, rt.load_scene("cornell"), rays,
                                        "kd-restart", {"schedule": schedule})
             for schedule in ("kernels", "loop")}
    alone = moved["loop"]["bytes"]
    # Camera rays have one common origin, a uniform. The only pass of `loop` reads directions and
    # writes hits; states stay in registers.
    assert alone == {"rays": 16 * 1024, "state": 0, "written": 16 * 1024}
    for part in ("rays", "state", "written"):
        assert moved["kernels"]["bytes"][part] > 3 * alone[part]


def test_utilisation_is_the_share_of_lanes_that_work(tmp_path: Path) -> None:
    """Utilisation is the number of lanes that work, divided by the number of issued lanes. Runs of
    the kernel `push` are not counted."""
    for cell in simd_width.cells(False):
        _keep(tmp_path, cell, _done(cell, 40 if cell.method == "bvh-stack" else 10, 5))
    rows = _page(simd_width, tmp_path)
    for row in rows:
        width = int(row["width"])
        assert float(row["utilisation"]) == pytest.approx(1 / width)
        runs = 45 if row["method"] == "bvh-stack" else 15
        assert float(row["kernel runs per ray"]) == pytest.approx(width * runs)
    table = (tmp_path / "simd_width.md").read_text()
    assert "packets of four rays need 960 kernel runs per ray in a kd-tree, and single" in table
    assert "in a BVH the numbers are 960 and 2880" in table


def test_stacks_limit_the_rays_in_flight(tmp_path: Path) -> None:
    for cell in stacks.cells(False):
        deep = cell.work.startswith(gap_work.STACKS)
        _keep(tmp_path, cell, {"levels": 32, "histogram": [0, 5, 2]} if deep
              else _done(cell, 10, 2))
    rows = {row["method"]: row for row in _page(stacks, tmp_path)}
    assert list(rows) == list(stacks.METHODS)
    card = machines()["G80"]
    stack = rows["kd-stack"]
    assert int(stack["bytes of stack"]) == 256
    assert int(stack["rays in flight"]) == 64  # the survey's number
    assert int(stack["deepest seen"]) == 2
    kept = int(rows["kd-restart"]["bytes a ray in registers"])
    assert kept == 4 * (8 + 3 + 4 + 8)
    assert int(rows["kd-restart"]["rays in flight"]) == card.registers // kept // 32 * 32
    # Each kernel run of a ray occupies the 32 lanes of its warp. A visit makes one fetch. A test
    # makes four fetches and waits twice for fetches.
    costs = {name: static_cost("g80", "kd-texture-stack", name, in_loop=True).arithmetic
             for name in ("down", "intersect", "push")}
    instructions = 32 * (10 * costs["down"] + 2 * costs["intersect"] + costs["push"])
    assert float(stack["instructions a ray"]) == pytest.approx(instructions)
    assert float(stack["fetches a ray"]) == pytest.approx(32 * (10 * 1 + 2 * 4))
    clocks = 4 * instructions + card.fetch_latency * 32 * (10 + 2 * 2)
    assert float(stack["rays to hide fetches"]) == pytest.approx(32 * clocks / (4 * instructions))
    assert float(stack["Mrays/s"]) == pytest.approx(1e-6 * card.multiprocessors * card.clock * min(
        64 / clocks, 32 / (4 * instructions)))


def test_a_method_without_compiled_kernels_still_has_bytes(tmp_path: Path) -> None:
    for cell in stacks.cells(False):
        deep = cell.work.startswith(gap_work.STACKS)
        _keep(tmp_path, cell, {"levels": 12, "histogram": [1]} if deep else _done(cell, 10, 2))
    rows = {row["method"]: row for row in _page(stacks, tmp_path)}
    short, row = rows["kd-short-stack"], rows["bvh-stack"]
    assert int(short["bytes a ray in registers"]) == 4 * (8 + 3 + 4 + 11 + 6)
    assert int(row["bytes a ray in registers"]) == 4 * (15 + 3)
    assert int(short["rays in flight"]) > 0 < int(row["rays in flight"])
    numbers = stacks.HEADS[4:7] + stacks.HEADS[8:]
    assert {row[head] for head in numbers} == {""} and all(short[head] for head in numbers)
    page = (tmp_path / "stacks.md").read_text()
    assert "* bvh-stack has no instructions, fetches and rates:" in page
    assert "kd-stack runs the kernels of kd-texture-stack and visits the same nodes" in page


@pytest.mark.parametrize("latency, held", [(500, False), (50_000, True)])
def test_the_paragraph_on_stacks_follows_the_numbers(tmp_path: Path, monkeypatch,
                                                     latency: int, held: bool) -> None:
    """The survey claims that kd-stack is slower than kd-restart. The claim holds if fetches are so
    slow that kd-stack's rays in flight cannot hide the fetches."""
    machine = machines()["G80"]
    monkeypatch.setitem(machine.figures, "fetch_latency", {
        **machine.figures["fetch_latency"], "value": latency})
    for cell in stacks.cells(False):
        deep = cell.work.startswith(gap_work.STACKS)
        visits = 30 if cell.method == "kd-restart" else 10
        _keep(tmp_path, cell, {"levels": 32, "histogram": [1]} if deep
              else _done(cell, visits, 2))
    rows = {row["method"]: float(row["Mrays/s"] or 0) for row in _page(stacks, tmp_path)}
    assert (rows["kd-stack"] < rows["kd-restart"]) is held
    page = (tmp_path / "stacks.md").read_text()
    assert f"the survey's claim {'holds' if held else 'does not hold'} for kd-stack" in page
    answer = page.split("\n\n")[1]
    restart, ropes = (rows[name] / rows["kd-stack"] for name in ("kd-restart", "kd-ropes"))
    assert answer.count(". ") == 0 and len(answer.split()) < 50
    assert f"it was {'right' if held else 'wrong'} to avoid the stack by restarts" in answer
    assert f"kd-restart traces {number(restart)} times as many" in answer
    assert f"kd-ropes {number(ropes)} times as many" in answer


def test_fewer_instructions_need_more_rays_to_hide_fetches() -> None:
    """A warp waits half of its time. So two warps (64 rays) would hide fetches, but only 48 rays
    fit."""
    peak = 16 * 1350 * 32 / (4 * 17280)     # Mrays/s
    row = ["", 0, 0, None, 17280, 0, 64.0, 48, 0.75, 0.75 * peak, peak]
    assert stacks._rate(row, 1) == pytest.approx(7.5)
    # With half of the arithmetic, the peak doubles, and 32 + 2 * 32 rays would hide the fetches.
    assert stacks._rate(row, 0.5) == pytest.approx(20 * 48 / 96)


def test_times_follow_from_the_rates_of_the_units(tmp_path: Path) -> None:
    for cell in ideal_hardware.cells(False):
        _keep(tmp_path, cell, _done(cell, 10, 5))
    rows = {(row["scene"], row["method"], row["machine"]): row
            for row in _page(ideal_hardware, tmp_path)}
    ideal, rpu = machines()["ideal"], machines()["RPU"]
    both = rows["kitchen", "kd-restart", "G80 and both"]
    assert float(both["steps ns"]) == pytest.approx(
        1e9 * 10 / (ideal.units * ideal.clock * ideal.steps))
    # The RPU has no compiler, so the R580's compiler counts the instructions.
    test = static_cost("r580", "kd-texture-stack", "intersect", in_loop=True).arithmetic
    prototype = rows["conference", "kd-texture-stack", "RPU"]
    assert float(prototype["shader ns"]) == pytest.approx(1e9 * 4 * 5 * test / rpu.vector_rate)
    assert prototype["published Mrays/s"] == "1.08"
    assert "Cell, transfers hidden" in {machine for _, _, machine in rows}
    page = (tmp_path / "ideal_hardware.md").read_text()
    assert "from memory" in page and "| RPU | compiler | r580 |" in page


@pytest.mark.parametrize("method, options", [
    ("kd-texture-stack", {}), ("bvh-threaded", {"octants": True}),
    ("kd-packet", {"packet": (2, 2)}), ("bvh-stack", {"sort_rays": True})])
def test_groups_of_every_width_fill_the_traced_squares(method: str, options: dict) -> None:
    """At width 1 no lane waits, so the number of lanes equals the number of runs. Wider groups use
    at least as many lanes as narrower groups."""
    scene, rays = rt.load_scene("cornell"), workload("cornell", EYE, 128)
    found = gap_work.measure(gap_work.DONE, scene, rays, method, dict(options))
    assert found["count"] == 4 * gap_work.SIDE ** 2
    assert found["lanes"]["1"] == found["runs"]
    part = rays.part(tile_pixels(128, gap_work.SIDE, gap_work.SPREAD))
    if "sort_rays" not in options:
        with rt.Tracer(scene, method, **options, **STEPWISE) as tracer:
            trace = record_trace(tracer, part.shape, lambda: part.trace(tracer))
        issued = issued_in_loop(trace, (4, 8), WHILE_WHILE, WITHIN)
        assert found["lanes"]["32"] == dict(zip(issued.kernels, issued.lanes))
    lanes = [sum(found["lanes"][str(width)].values()) for width in (1, 2, 4, 8, 16, 32, 64)]
    assert lanes == sorted(lanes)
    assert bool(found["transfers"]) is (method in gap_work.MISSES)
    one, most = "131072 16 4", "8192 16 4"      # a larger cache misses less
    assert not found["transfers"] or 0 < found["transfers"][one] <= found["transfers"][most]


def test_a_square_of_sorted_rays_follows_their_order() -> None:
    """Each aligned block of 8x8 rays holds 64 rays that are consecutive in the sorted order."""
    rays = workload("cornell", EYE, 128)
    squares = gap_work._sorted_squares(rt.load_scene("cornell"), rays)
    with rt.Tracer(rt.load_scene("cornell"), "bvh-threaded", sort_rays=True) as tracer:
        with observe_order(tracer) as orders:
            rays.trace(tracer)
    place = np.argsort(orders[0])[squares]
    assert squares.shape == (48, 192) and len(np.unique(squares)) == squares.size
    blocks = place.reshape(6, 8, 24, 8).transpose(0, 2, 1, 3).reshape(-1, 64)
    assert (np.ptp(blocks, axis=1) == 63).all()
