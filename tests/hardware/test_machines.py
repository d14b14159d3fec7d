"""Tests of the times predicted for cards, for machines with ray tracing units and for the Cell."""
from __future__ import annotations

from typing import Any

import pytest

from gpgpu_rt.hardware.cards import find_card
from gpgpu_rt.hardware.loop_costs import LoopCost, loop_costs
from gpgpu_rt.hardware.machines import (
    instructions_a_ray, machines, on_card, on_cell, on_prototype, runs, with_shading
)
from gpgpu_rt.hardware.static_costs import static_cost

# The work of 32 rays. A ray runs 20 visits, 3 tests and 5 pushes. A key of `lanes` is a SIMD
# width. A key of `transfers` gives the bytes of a cache, the bytes of a line, and the number of
# rays that fetch together.
WORK: dict[str, Any] = {
    "count": 32, "runs": {"down": 640, "intersect": 96, "push": 160},
    "lanes": {"1": {"down": 640, "intersect": 96, "push": 160},
              "4": {"down": 800, "intersect": 160, "push": 200},
              "32": {"down": 1280, "intersect": 384, "push": 320}},
    "transfers": {"8192 16 32": 64, "8192 16 4": 99, "131072 128 4": 16}}
COSTS = {"down": LoopCost(60, 1, 1), "intersect": LoopCost(100, 4, 2), "push": LoopCost(5)}


def test_kernels_of_ray_tracing_units_need_no_shader_time() -> None:
    card, ideal = find_card("G80"), machines()["ideal"]
    assert (runs(WORK, "steps"), runs(WORK, "tests")) == (20, 3)
    visits, tests, pushes = 1280 * 60 / 32, 384 * 100 / 32, 320 * 5 / 32
    alone = on_card(card, WORK, COSTS)
    assert alone.shader == pytest.approx((visits + tests + pushes) / card.issue_rate)
    assert alone.memory == pytest.approx(16 * 64 / card.bandwidth / 32)
    older = on_card(find_card("R420"), WORK, COSTS, width=32)   # the card's own bandwidth
    assert older.memory == pytest.approx(16 * 64 / find_card("R420").bandwidth / 32)
    nobody_waits = on_card(card, WORK, COSTS, width=1)
    assert nobody_waits.shader == pytest.approx(
        (20 * 60 + 3 * 100 + 5 * 5) / card.issue_rate)
    hard_tests = on_card(card, WORK, COSTS, ideal, "tests")
    assert hard_tests.shader == pytest.approx((visits + pushes) / card.issue_rate)
    assert hard_tests.tests == pytest.approx(3 / (ideal.units * ideal.clock))
    assert hard_tests.steps == 0
    hard_steps = on_card(card, WORK, COSTS, ideal, "steps")     # a push is part of a step
    assert hard_steps.shader == pytest.approx(tests / card.issue_rate)
    both = on_card(card, WORK, COSTS, ideal, "both")
    assert both.shader == 0
    assert both.steps == pytest.approx(20 / (ideal.units * ideal.clock))
    assert both.memory == pytest.approx(2 * 16 / ideal.bandwidth)
    assert both.seconds == max(both.steps, both.memory, both.tests)


def test_a_card_that_fetches_more_than_it_computes_is_bound_by_its_texels() -> None:
    """If fetches take longer than instructions, idle lanes do not change the predicted time,
    because idle lanes fetch nothing."""
    card, costs = find_card("G80"), {name: LoopCost(1, 50) for name in COSTS}
    assert on_card(card, WORK, costs).shader == pytest.approx(28 * 50 / card.texel_rate)


def test_prototypes_step_packets() -> None:
    """The RPU's units traverse and push, and its shader tests triangles for packets of four
    rays."""
    rpu, saarcor = machines()["RPU"], machines()["SaarCOR"]
    least = on_prototype(rpu, WORK, COSTS)
    assert least.steps == pytest.approx(800 / 4 / 32 / rpu.clock)
    assert least.shader == pytest.approx(160 * 100 / 32 / rpu.vector_rate)
    assert least.memory == pytest.approx(99 * 16 / 32 / rpu.bandwidth)
    other = on_prototype(saarcor, WORK, COSTS)
    assert other.shader == 0
    assert other.tests == pytest.approx(3 / saarcor.clock)
    assert other.steps == pytest.approx(20 / 4 / saarcor.clock)


def test_the_cell_waits_for_transfers() -> None:
    """One vector instruction executes a scalar instruction for four rays. A packet of four rays
    fetches a texel once for all its rays. The packets' 200 visits fetch one texel each, and
    their 40 tests fetch four texels each."""
    cell = machines()["Cell"]
    hidden, waited = (on_cell(cell, WORK, COSTS, one) for one in (True, False))
    vectors = 200 * 60 + 40 * 100 + 50 * 5
    assert hidden.shader == pytest.approx(
        (vectors + cell.lookup * (200 + 4 * 40)) / cell.vector_rate / 32)
    assert hidden.memory == pytest.approx(16 * 128 / cell.bandwidth / 32)
    assert hidden.waiting == 0
    assert waited.seconds - hidden.seconds == pytest.approx(
        16 * cell.latency / (cell.clock * cell.units) / 32)


def test_shading_on_the_cell_waits_for_its_transfers() -> None:
    cell = machines()["Cell"]
    traced = on_cell(cell, WORK, COSTS, True)
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
    faster = (on_prototype(prototype, WORK, COSTS).steps / on_prototype(design, WORK, COSTS).steps)
    assert faster == pytest.approx(design.clock * design.units / prototype.clock)


def test_a_loop_fetches_only_tables() -> None:
    """A visit of a kd-tree reads a node. A test reads a reference, then a triangle. A push or pop
    uses on-chip memory. All other fetches read streams, which a loop keeps in registers."""
    costs = loop_costs("g80", "kd-texture-stack")
    found = {kernel: (cost.fetches, cost.levels) for kernel, cost in costs.items()}
    assert found == {"init": (0, 0), "down": (1, 1), "intersect": (4, 2), "push": (0, 0),
                     "pop": (0, 0)}
    assert costs["down"].instructions == static_cost(
        "g80", "kd-texture-stack", "down", in_loop=True).arithmetic
    # The text of `down` declares a stream that the compiler drops. Only real fetches count.
    ropes = loop_costs("g80", "kd-ropes")
    assert (ropes["down"].fetches, ropes["follow_rope"].fetches) == (1, 4)
    bvh = loop_costs("r580", "bvh-threaded", octants=True)
    assert (bvh["traverse"].fetches, bvh["intersect"].fetches) == (2, 3)


def test_issued_instructions_include_idle_lanes() -> None:
    assert instructions_a_ray(WORK, COSTS, 32) == (1280 * 60 + 384 * 100 + 320 * 5) / 32
    assert instructions_a_ray(WORK, COSTS, 4, "steps") == 160 * 100 / 32
    assert instructions_a_ray(WORK, COSTS, 1, "both") == 0


def test_every_figure_of_a_machine_has_its_source() -> None:
    for one in machines().values():
        for name, figure in one.figures.items():
            assert set(figure) == {"value", "unit", "source", "read"} and figure["source"]
            recalled = figure["source"].startswith(("from memory", "assumed"))
            assert figure["read"] is not recalled or not figure["read"], (one.chip, name)
