"""Under the schedule `loop`, the state of a ray stays in registers, unless rays reach a limit or
an observer needs the state."""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt import hits
from gpgpu_rt.inspect.observe import observe_states
from gpgpu_rt.rays.ray_sets import random_rays

# The methods that use the driver of single rays under `loop`.
SINGLE = [row.name for row in rt.methods() if "loop" in row.schedules
          and "loop" not in row.drivers]


@pytest.mark.parametrize("method", SINGLE)
def test_a_pass_writes_hits_only(precise_renderer, method: str) -> None:
    scene = rt.load_scene("cornell")
    origins, directions = random_rays(scene, 200, 1)
    with rt.Tracer(scene, method, schedule="loop") as tracer:
        with tracer.observe() as passes:
            found = tracer.trace(origins, directions)
        main = [one for one in passes if one.name == "drivers/traverse.frag"]
        assert [len(one.outputs) for one in main] == [1]
        assert tracer.statistics.queries == 1 and not found.status.any()
        seen = []
        with observe_states(tracer, seen.append):
            watched = tracer.trace(origins, directions)
        assert [tracer.method.state.name in one.target.records for one in seen] == [True]
        again = tracer.trace(origins, directions)
    for name in ("t", "u", "v", "triangle"):
        expected = getattr(found, name)
        np.testing.assert_array_equal(getattr(watched, name), expected)
        np.testing.assert_array_equal(getattr(again, name), expected)


@pytest.mark.parametrize("method", ["kd-restart", "bvh-threaded", "grid"])
@pytest.mark.parametrize("cap", [1, 5, 40])
def test_stopped_rays_are_found(precise_renderer, method: str, cap: int) -> None:
    """If the step cap stops rays, their status and hits equal those under `step`. A later call
    without a stopped ray reports no stopped ray."""
    scene = rt.load_scene("cornell")
    origins, directions = random_rays(scene, 300, 2)
    with rt.Tracer(scene, method, schedule="step", step_cap=cap) as tracer:
        expected = tracer.trace(origins, directions)
    assert (expected.status == hits.UNFINISHED).any() or cap == 40
    with rt.Tracer(scene, method, schedule="loop", step_cap=cap) as tracer:
        for _ in range(2):
            found = tracer.trace(origins, directions)
            for name in ("t", "triangle", "status"):
                np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
            assert tracer.statistics.stopped == (expected.status == hits.UNFINISHED).sum()
        nothing = tracer.trace(origins, directions, t_max=-1.0)
        assert not nothing.status.any() and not nothing.hit.any()


def test_a_limit_on_iterations_is_remembered_once_exceeded(precise_renderer, monkeypatch) -> None:
    """Once rays exceed the limit on iterations, later calls store states from the first pass
    on."""
    monkeypatch.setattr("gpgpu_rt.traversal.schedules.LOOP_STEPS", 7)
    scene = rt.load_scene("cornell")
    origins, directions = random_rays(scene, 300, 3)
    brute = rt.Tracer(scene, "brute-force").trace(origins, directions)
    with rt.Tracer(scene, "kd-restart", schedule="loop") as tracer:
        passes = []
        for _ in range(2):
            found = tracer.trace(origins, directions)
            np.testing.assert_array_equal(found.t, brute.t)
            np.testing.assert_array_equal(found.triangle, brute.triangle)
            passes.append(tracer.statistics.passes)
    assert passes[0] == passes[1] + 1
