"""Predicted times of machines with ray tracing units, and the misses of a software cache."""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.hardware.cards import find_card
from gpgpu_rt.hardware.local_store import Fetches, transfers
from gpgpu_rt.hardware.machines import (
    machines, on_card, on_cell, on_prototype, runs, with_shading, without
)
from gpgpu_rt.hardware.sample import emulated


@pytest.mark.parametrize("seed", [3, 4])
def test_a_direct_mapped_cache_misses_what_its_places_lost(seed: int) -> None:
    random = np.random.default_rng(seed)
    lines = random.integers(0, 40, 500) + (random.integers(1, 3, 500) << 40)
    for places in (1, 8, 16, 1000):
        held: dict[int, int] = {}
        missed = 0
        for line in lines.tolist():
            place = (line + (line >> 40) * 7919) % places
            missed += held.get(place) != line
            held[place] = line
        assert transfers(lines, places) == missed
    assert transfers(lines, 1 << 23) == len(set(lines.tolist()))


def test_every_fetch_of_an_emulation_is_seen_ray_after_ray(countable) -> None:
    scene, fetches = rt.load_scene("cornell"), Fetches()
    origins, directions = scene.camera.rays((16, 16))
    with rt.Tracer(scene, "kd-restart") as tracer:
        run, _ = emulated(tracer, origins, directions, tile=(16, 16), widths=(1,), look=fetches)
    tables = sum(n for name, n in run.fetches().items() if name.endswith("_table"))
    lines = fetches.in_order(16)
    assert len(lines) == tables > 0
    root = lines[0]  # every ray starts here
    assert np.count_nonzero(lines == root) >= run.fragments
    # In lockstep, every ray begins before any ray continues.
    assert (fetches.in_order(16, run.fragments)[:run.fragments] == root).all()
    whole = [transfers(fetches.in_order(line), 1 << 20) for line in (16, 128)]
    assert whole[0] >= whole[1] >= whole[0] / 8


def _work(runs_of: dict[str, dict[int, int]]) -> dict:
    """Returns a record of the work of 32 rays. A ray needs 10 instructions outside the loops, 20
    instructions and a fetch per step, and 50 instructions and three fetches per triangle test."""
    def region(cost: int, fetches: dict, parent: int, loop: bool, name: str) -> dict:
        return {"vector": cost, "scalar": 2 * cost, "fetches": fetches, "parent": parent,
                "loop": loop, "runs": {str(w): n for w, n in runs_of[name].items()}}
    return {"count": 32, "fragments": 32, "written_bytes": 0, "texel_bytes": {},
            "kernels": ["", "", "down", "intersect"],
            "transfers": {"8192 16 32": 64, "8192 16 4": 99, "131072 128 4": 16},
            "regions": [region(10, {}, -1, False, "once"), region(0, {}, 0, True, "once"),
                        region(20, {"kd_node_table": 1}, 1, True, "down"),
                        region(50, {"triangle_table": 3}, 1, True, "intersect")]}


WORK = _work({"once": {1: 32, 4: 8, 32: 1}, "down": {1: 640, 4: 200, 32: 40},
              "intersect": {1: 96, 4: 40, 32: 12}})


def test_units_take_their_kernels_out_of_the_shader() -> None:
    card, ideal = find_card("G80"), machines()["ideal"]
    assert (runs(WORK, "steps"), runs(WORK, "tests")) == (20, 3)
    alone = on_card(card, WORK)
    assert alone.shader == pytest.approx(
        32 * (20 + 40 * 40 + 12 * 100) / card.scalar_rate / 32)
    assert alone.memory == pytest.approx(16 * 64 / card.bandwidth / 32)
    older = on_card(find_card("R420"), WORK)  # each card has its own memory
    assert older.memory == pytest.approx(16 * 64 / find_card("R420").bandwidth / 32)
    assert older.memory > alone.memory
    nobody_waits = on_card(card, WORK, width=1)
    assert nobody_waits.shader == pytest.approx((20 + 20 * 40 + 3 * 100) / card.scalar_rate)
    tests = on_card(card, WORK, ideal, "tests")
    assert tests.shader == pytest.approx((20 + 40 * 40) / card.scalar_rate)
    assert tests.tests == pytest.approx(3 / (ideal.units * ideal.clock)) and tests.steps == 0
    both = on_card(card, WORK, ideal, "both")
    assert both.shader == pytest.approx(20 / card.scalar_rate)
    assert both.steps == pytest.approx(20 / (ideal.units * ideal.clock))
    assert both.memory == pytest.approx(2 * 16 / ideal.bandwidth)
    assert both.seconds == max(both.steps, both.memory, both.shader, both.tests)
    assert without(WORK, "") == WORK


def test_prototypes_step_packets_and_the_cell_waits_for_transfers() -> None:
    rpu, cell = machines()["RPU"], machines()["Cell"]
    least = on_prototype(rpu, WORK)
    assert least.steps == pytest.approx(200 / 32 / rpu.clock)
    assert least.shader == pytest.approx(4 * (8 * 10 + 40 * 50) / 32 / rpu.vector_rate)
    saarcor = on_prototype(machines()["SaarCOR"], WORK)
    assert saarcor.shader == 0
    assert saarcor.tests == pytest.approx(3 / machines()["SaarCOR"].clock)
    hidden, waited = (on_cell(cell, WORK, one) for one in (True, False))
    fetched = 200 + 3 * 40
    assert hidden.shader == pytest.approx(
        (8 * 20 + 200 * 40 + 40 * 100 + cell.lookup * fetched) / cell.vector_rate / 32)
    assert hidden.waiting == 0
    assert waited.seconds - hidden.seconds == pytest.approx(
        16 * cell.latency / (cell.clock * cell.units) / 32)


def test_shading_on_the_cell_waits_for_its_transfers() -> None:
    cell = machines()["Cell"]
    traced = on_cell(cell, WORK, True)
    shaded = with_shading(cell, traced)
    assert shaded.shader - traced.shader == pytest.approx(cell.shading / cell.vector_rate)
    assert shaded.waiting == pytest.approx(
        cell.shading_transfers * cell.latency / (cell.clock * cell.units))
    assert shaded.memory - traced.memory == pytest.approx(
        cell.shading_transfers * cell.line / cell.bandwidth)
    twice = with_shading(cell, traced, 2)
    assert twice.waiting == pytest.approx(2 * shaded.waiting) and twice.shader == shaded.shader


def test_the_saarcor_of_2002_outruns_the_prototype_by_clock_and_cores() -> None:
    design, prototype = machines()["SaarCOR 2002"], machines()["SaarCOR"]
    faster = on_prototype(prototype, WORK).steps / on_prototype(design, WORK).steps
    assert faster == pytest.approx(design.clock * design.units / prototype.clock)


def test_every_figure_of_a_machine_has_its_source() -> None:
    for one in machines().values():
        for name, figure in one.figures.items():
            assert set(figure) == {"value", "unit", "source", "read"} and figure["source"]
            recalled = figure["source"].startswith(("from memory", "assumed"))
            assert figure["read"] is not recalled or not figure["read"], (one.chip, name)
