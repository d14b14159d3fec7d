"""Tests of traces of kernels. A model counts how often groups of lanes issue each kernel of a
trace, and predicts the time that a card needs for the kernels."""
from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.errors import OptionError
from gpgpu_rt.hardware.cards import find_card
from gpgpu_rt.hardware.issue import (
    ORDERS, STEP, WHILE_WHILE, KernelIssues, in_groups, issued_in_loop, issued_in_passes
)
from gpgpu_rt.hardware.machine_model import (
    ASSUMED, UNCOALESCED_BYTES, CardTime, stream_fetches, time_of_loop, time_of_passes
)
from gpgpu_rt.hardware.static_costs import StaticCost
from gpgpu_rt.hardware.trace import KernelTrace, record_trace

SIZE = (32, 32)
METHODS = ("grid", "kd-restart", "kd-backtrack", "kd-ropes", "bvh-threaded")


def _recorded(scene: rt.Scene, method: str) -> KernelTrace:
    with rt.Tracer(scene, method, schedule="step", steps_per_pass=1,
                   intersection="moller-trumbore") as tracer:
        return record_trace(tracer, SIZE, lambda: tracer.trace(*scene.camera.rays(SIZE[::-1])))


@pytest.mark.parametrize("method", METHODS)
def test_simulated_passes_are_the_passes_of_the_era_form(method: str) -> None:
    scene = rt.load_scene("cornell")
    issued = issued_in_passes(_recorded(scene, method))
    with rt.Tracer(scene, method, era="nv40") as tracer:
        tracer.trace(*scene.camera.rays(SIZE[::-1]))
        ran = tracer.statistics
    assert dict(zip(issued.kernels, issued.passes)) == {
        name: ran.kernel_passes.get(name, 0) for name in issued.kernels}
    # The tracer makes one more query, which counts the rays that the step cap stopped.
    assert issued.queries == ran.queries - 1


def test_runs_are_the_steps_that_the_shaders_count() -> None:
    scene = rt.load_scene("cornell")
    trace = _recorded(scene, "kd-restart")
    with rt.Tracer(scene, "kd-restart", intersection="moller-trumbore",
                   statistics=True) as tracer:
        tracer.trace(*scene.camera.rays(SIZE[::-1]))
        counters = tracer.statistics.counters
    assert sum(trace.totals().values()) == pytest.approx(counters["steps"] * 32 * 32)
    assert trace.runs("intersect").sum() == trace.totals()["intersect"]
    assert trace.rays <= 32 * 32 and trace.steps[-1].any()


def test_other_schedules_are_refused() -> None:
    scene = rt.load_scene("cornell")
    with rt.Tracer(scene, "grid") as tracer, pytest.raises(OptionError, match="schedule to step"):
        record_trace(tracer, SIZE, lambda: None)


def _random_trace(size: tuple[int, int] = (8, 12)) -> KernelTrace:
    rng = np.random.default_rng(3)
    steps = rng.integers(1, 4, (20, *size)).astype(np.uint8)
    steps[np.arange(20)[:, None, None] >= rng.integers(0, 20, size)] = 0
    return KernelTrace(("down", "intersect", "pop"), steps)


def _by_hand(rays: list[list[int]], order: str) -> Counter:
    """Count the issues of one group of rays by running the group's program step by step."""
    rays, issues = [list(ray) for ray in rays], Counter()
    while any(rays):
        if order == STEP:
            issues.update({ray[0] for ray in rays if ray})
            rays = [ray[1:] for ray in rays]
            continue
        for kernel in (1, 2, 3):
            while any(ray and ray[0] == kernel for ray in rays):
                issues[kernel] += 1
                rays = [ray[1:] if ray and ray[0] == kernel else ray for ray in rays]
    return issues


@pytest.mark.parametrize("order", ORDERS)
def test_groups_issue_what_a_program_with_loops_issues(order: str) -> None:
    trace = _random_trace()
    groups, expected = in_groups(trace.steps, (4, 8)), Counter()
    assert groups.shape == (20, 4, 32)      # 12 columns are padded to 16
    for group in range(4):
        expected += _by_hand([[k for k in groups[:, group, lane] if k] for lane in range(32)],
                             order)
    issued = issued_in_loop(trace, (4, 8), order)
    assert issued.lanes == tuple(32 * expected[kernel] for kernel in (1, 2, 3))
    assert 0 < issued.idle < 1 and issued.iterations >= 32 * 4


def test_a_kernel_within_another_has_no_loop_of_its_own() -> None:
    """Two rays visit two nodes each, and the first ray pushes between its visits. If the push has
    a loop of its own, the first ray waits for that loop, and the group issues a third visit."""
    steps = np.array([[1, 1], [3, 1], [1, 2], [0, 0]], np.uint8)[:, None, :]
    trace = KernelTrace(("down", "intersect", "push"), steps)
    assert issued_in_loop(trace, (1, 2), WHILE_WHILE).lanes == (6, 2, 2)
    within = issued_in_loop(trace, (1, 2), WHILE_WHILE, ("push",))
    assert within.lanes == (4, 2, 2) and within.runs == (4, 1, 1)
    # A kernel within another is issued once for all rays that run it in the same visit.
    both = KernelTrace(trace.kernels, np.array([[1, 1], [3, 3], [1, 1]], np.uint8)[:, None, :])
    assert issued_in_loop(both, (1, 2), WHILE_WHILE, ("push",)).lanes == (4, 0, 2)
    # If a ray's first step is a push, the push waits until the other ray has left the inner loop.
    begins = KernelTrace(trace.kernels, np.array([[1, 3], [1, 1]], np.uint8)[:, None, :])
    assert issued_in_loop(begins, (1, 2), WHILE_WHILE, ("push",)).lanes == (6, 0, 2)


@pytest.mark.parametrize("method, side", [("kd-packet", 2), ("bvh-packet", 2), ("bvh-stack", 1)])
def test_a_packet_runs_as_one_ray(method: str, side: int) -> None:
    """The visits and tests of a packet are the steps that the shaders count for its rays."""
    scene = rt.load_scene("cornell")
    options = {"packet": (side, side)} if side > 1 else {}
    found = []
    with rt.Tracer(scene, method, schedule="step", statistics=True, **options) as tracer:
        trace = record_trace(tracer, SIZE, lambda: found.append(
            tracer.trace(*scene.camera.rays(SIZE[::-1]))))
    visits = trace.runs("traverse") + trace.runs("intersect")
    assert (visits == found[0].steps.reshape(SIZE)[::side, ::side]).all() and visits.any()


def test_recorded_fields_are_those_that_a_step_reads() -> None:
    scene = rt.load_scene("cornell")
    with rt.Tracer(scene, "kd-restart", schedule="step", steps_per_pass=1) as tracer:
        trace = record_trace(tracer, SIZE, lambda: tracer.trace(*scene.camera.rays(SIZE[::-1])),
                             ("node", "cursor", "steps"))
    down, test = (trace.steps == number for number in (1, 2))
    assert trace.fields["node"].shape == trace.steps.shape
    assert (trace.fields["node"][0][down[0]] == 0).all() and down[0].any()      # the root
    # A ray's step count is the number of its steps before this step.
    ran = np.concatenate([np.zeros((1, *SIZE), int), np.cumsum(trace.steps != 0, axis=0)[:-1]])
    assert (trace.fields["steps"] == ran)[down | test].all()


def test_a_group_of_one_ray_never_waits() -> None:
    for order in ORDERS:
        issued = issued_in_loop(_random_trace(), (1, 1), order)
        assert issued.lanes == issued.runs and issued.idle == 0


def _cost(**counts: int) -> dict[str, StaticCost]:
    return {"down": StaticCost("nv40", "kd-restart", "down", **counts)}


STREAMS = {"down": 4}     # fetches of `down` that read streams


def _time(chip: str, **counts: int) -> CardTime:
    issued = KernelIssues(("down",), runs=(10 ** 9,), lanes=(4 * 10 ** 9,), passes=(0,))
    return time_of_passes(find_card(chip), issued, _cost(**counts), STREAMS, 1)


def test_the_slowest_unit_bounds_a_kernel() -> None:
    card = find_card("R420")
    found = _time("R420", arithmetic=50, fetches=6, targets=2)
    # A texel of a stream takes the time of two cached texels.
    texture, arithmetic = (2 + 2 * 4) / card.texel_rate, 50 / card.issue_rate
    assert arithmetic > texture
    assert found.parts["arithmetic"] == pytest.approx(1e9 * arithmetic)
    assert found.parts["waiting lanes"] == pytest.approx(3e9 * arithmetic)
    fetching = _time("R420", arithmetic=20, fetches=6, targets=2)
    assert fetching.seconds == pytest.approx(4e9 * texture)
    writing = _time("R420", arithmetic=1, fetches=4, targets=20)
    assert writing.seconds == pytest.approx(4e9 * (4 + 20) * 16 / card.bandwidth)


def test_fetches_of_the_6800_take_slots_of_its_arithmetic() -> None:
    card = find_card("NV40")
    found = _time("NV40", arithmetic=50, fetches=6, targets=2)
    texture, arithmetic = (2 + 2 * 4) / card.texel_rate, 50 / card.issue_rate
    assert found.parts["arithmetic"] == pytest.approx(1e9 * arithmetic)
    assert found.parts["texture"] == pytest.approx(1e9 * texture)
    assert found.parts["waiting lanes"] == pytest.approx(3e9 * (arithmetic + texture))
    writing = _time("NV40", arithmetic=1, fetches=4, targets=20)
    assert writing.seconds == pytest.approx(4e9 * (4 + 20) * 16 / card.bandwidth)
    assert not writing.parts["texture"]


def test_passes_and_queries_cost_the_host_time() -> None:
    card = find_card("NV40")
    issued = KernelIssues(("down",), (0,), (0,), passes=(90,), queries=10)
    found = time_of_passes(card, issued, _cost(), STREAMS, 512 * 512)
    # The early depth test rejects pixels only in the passes of kernels. The pass of a query
    # therefore fetches the state of every pixel.
    counted = card.stream_fetch * 512 * 512 / card.texel_rate
    assert found.parts["queries"] == pytest.approx(10 * (ASSUMED.query_seconds + counted))
    assert found.parts["passes"] == pytest.approx(
        100 * ASSUMED.draw_seconds + 90 * 512 * 512 / card.depth_rate)


def test_a_loop_keeps_the_ray_in_registers() -> None:
    # `down` fetches six texels. Five are from streams: two of the ray, two of the state and one of
    # the hit. The sixth is a node.
    assert stream_fetches("kd-restart", "down") == 5
    # As a pass, `down` fetches the same number of texels from streams.
    assert stream_fetches("kd-restart", "down", in_loop=False) == 5
    card, streams = find_card("NV40"), {"down": 5}
    issued = KernelIssues(("down",), (1000,), (1000,))
    costs = _cost(arithmetic=0, fetches=6, targets=2)
    found = time_of_loop(card, issued, costs, streams, 0)
    branch = 1 / card.texel_rate + ASSUMED.branch_instructions / card.issue_rate
    assert found.seconds == pytest.approx(1000 * branch + ASSUMED.draw_seconds)


def test_lanes_of_a_warp_load_a_texel_together() -> None:
    card, streams = find_card("G80"), {"down": 5}
    issued, costs = KernelIssues(("down",), (1000,), (2000,)), _cost(fetches=37)
    alone, together = (time_of_loop(card, issued, costs, streams, 0, sharing=sharing)
                       for sharing in (1, 32))
    assert alone.seconds - ASSUMED.draw_seconds == pytest.approx(2000 * 32 / card.texel_rate)
    assert together.seconds - ASSUMED.draw_seconds == pytest.approx(2000 / card.texel_rate)
    # A pixel's instructions outside the loop run while the texels of its ray are fetched.
    short, long = (time_of_loop(card, issued, costs, streams, 1000, setup=setup).seconds
                   - alone.seconds for setup in (1, 1000))
    assert short == pytest.approx(1000 * 2 * card.stream_fetch / card.texel_rate)
    assert long == pytest.approx(1000 * 1000 / card.issue_rate)
    # If loads bypass the texture units, each run loads its own bytes, and waiting lanes load none.
    past = time_of_loop(card, issued, costs, streams, 0, uncoalesced=True)
    assert past.seconds - ASSUMED.draw_seconds == pytest.approx(
        1000 * 32 * UNCOALESCED_BYTES / card.bandwidth)


def test_each_assumption_is_halved_and_doubled() -> None:
    varied = ASSUMED.varied()
    half, double = varied["query_seconds"]
    assert double.query_seconds == 4 * half.query_seconds
    assert half.draw_seconds == ASSUMED.draw_seconds and len(varied) == 4


@pytest.mark.parametrize("seed", range(3), ids="seed{}".format)
def test_early_depth_rejects_quads_without_a_waiting_ray(seed: int) -> None:
    """If the rays of each quad take the same steps, no lane waits. Otherwise, lanes wait."""
    kernels = np.random.default_rng(seed).integers(0, 3, (6, 8, 8)).astype(np.uint8)
    kernels[np.cumsum(kernels == 0, axis=0) > 0] = 0      # a ray that has ended stays ended
    alike = kernels.repeat(2, axis=1).repeat(2, axis=2)
    equal, mixed = (issued_in_passes(KernelTrace(("down", "intersect"), steps), 1)
                    for steps in (alike, kernels))
    assert equal.lanes == equal.runs == tuple(4 * runs for runs in mixed.runs)
    assert equal.passes == mixed.passes
    assert all(lanes > runs and lanes % 4 == 0 for lanes, runs in zip(mixed.lanes, mixed.runs))
