"""Observed passes: `observe` reports every draw with its textures and counts."""
from __future__ import annotations

import pytest

import gpgpu_rt as rt
from gpgpu_rt.gl.target import Target
from gpgpu_rt.inspect.observe import ObservedPass, observe_states
from gpgpu_rt.methods import find_method
from gpgpu_rt.rays.batch import RayBatch
from gpgpu_rt.rays.records import HIT

SIDE = 12
CASES = [(row.name, schedule) for row in rt.methods() for schedule in row.schedules]
HITS_BY_HOST = {"ray-engine"}    # the host writes the final states, so no pass does


@pytest.fixture(scope="module")
def scene() -> rt.Scene:
    return rt.load_scene("cornell")


@pytest.mark.parametrize("method, schedule", CASES)
def test_every_draw_is_observed(scene: rt.Scene, method: str, schedule: str) -> None:
    rays = scene.camera.rays((SIDE, SIDE))
    state = find_method(method).state.name
    last: dict[str, dict] = {}

    def look(one: ObservedPass) -> None:
        if isinstance(one.target, Target) and {state, HIT.name} <= set(one.target.records):
            last.update({name: one.target.fields(name) for name in (state, HIT.name)})
    with rt.Tracer(scene, method, schedule=schedule, statistics=True) as tracer:
        with tracer.observe(look, fragments=True) as passes:
            hits = tracer.trace(*rays)
        statistics = tracer.statistics
        assert [one.number for one in passes] == list(range(len(passes)))
        # `statistics.passes` leaves out draws that mask, count or classify rays.
        assert len(passes) == statistics.draw_calls >= statistics.passes > 0
        logged = {}
        for one in passes:
            assert one.texts[1].startswith("#version") and set(one.inputs) <= set(one.program)
            work = logged.setdefault((one.label, one.texts), [one.label, 0, 0])
            work[1:] = work[1] + 1, work[2] + one.fragments
        assert list(logged.values()) == [[one[key] for key in ("name", "draws", "fragments")]
                                         for one in statistics.pass_log]
        if schedule not in find_method(method).drivers:     # the common driver runs this schedule
            kernels = [one.kernel for one in passes if one.kernel]
            assert kernels[0] == ("all" if schedule == "loop" else "init")
            assert len(kernels) == statistics.passes
    if method in HITS_BY_HOST:
        assert not last
        return
    found = RayBatch(*rays, bounds=scene.bounds).hits(last[HIT.name])
    assert (found.triangle == hits.triangle).all() and hits.hit.any()
    assert (found.t == hits.t).all()
    assert (last[state]["phase"][:SIDE * SIDE] == 0).all()


def test_stages_are_observed_too(scene: rt.Scene) -> None:
    with rt.Tracer(scene, "bvh-packet", entry_points=8, sort_rays=True) as tracer:
        with tracer.observe() as passes:
            tracer.trace(*scene.camera.rays((SIDE, SIDE)))
    names = [one.name for one in passes]
    assert names.index("stages/sort_gather.frag") < names.index("stages/packet_entries.frag")
    assert names.index("stages/packet_entries.frag") < names.index("drivers/packet.frag")
    assert all(one.fragments is None and one.primitives is None for one in passes)


def test_nothing_is_observed_before_or_after(scene: rt.Scene) -> None:
    rays = scene.camera.rays((SIDE, SIDE))
    with rt.Tracer(scene, "kd-restart") as tracer:
        tracer.trace(*rays)
        with pytest.raises(ZeroDivisionError), tracer.observe(lambda one: 1 / 0) as passes:
            tracer.trace(*rays)
        assert len(passes) == 1 and not tracer.gpu.observers
        hits = tracer.trace(*rays)
        with tracer.observe() as passes:
            again = tracer.trace(*rays)
        observed = len(passes)
        tracer.trace(*rays)
        assert len(passes) == observed == tracer.statistics.draw_calls
    assert (again.triangle == hits.triangle).all() and (again.t == hits.t).all()


@pytest.mark.parametrize("method", ["bvh-packet", "kd-packet", "kd-ropes-packet"])
def test_states_of_packets_and_their_rays(scene: rt.Scene, method: str) -> None:
    seen = []
    with rt.Tracer(scene, method, schedule="step") as tracer:
        with observe_states(tracer, lambda one: seen.append((one.kernel, one.target.size))):
            tracer.trace(*scene.camera.rays((SIDE, SIDE)))
        assert len(seen) == tracer.statistics.passes
    assert seen[:2] == [("init", (SIDE // 2, SIDE // 2)), ("init", (SIDE, SIDE))]
    assert {kernel for kernel, _ in seen} == {"init", "visit", "intersect"}
