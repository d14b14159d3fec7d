"""In the past, schedules made a new OpenGL query each time they counted rays. moderngl cannot
delete queries, so a search with millions of passes filled gigabytes of memory."""
from __future__ import annotations

import moderngl
import pytest

import gpgpu_rt as rt


@pytest.mark.parametrize("observed", [False, True])
@pytest.mark.parametrize("schedule", ["kernels", "step"])
def test_queries_are_used_again(monkeypatch: pytest.MonkeyPatch, schedule: str,
                                observed: bool) -> None:
    made, query = [], moderngl.Context.query

    def counted(self: moderngl.Context, **kinds: bool) -> moderngl.Query:
        made.append(kinds)
        return query(self, **kinds)

    monkeypatch.setattr(moderngl.Context, "query", counted)
    scene = rt.load_scene("cornell")
    origins, directions = scene.camera.rays((16, 16))
    with rt.Tracer(scene, "kd-restart", schedule=schedule, mask_interval=2) as tracer:
        if observed:
            with tracer.observe(fragments=True) as passes:
                tracer.trace(origins, directions)
            fragments = [one.fragments for one in passes]
            tracer.trace(origins, directions)
            # A later call uses the queries again, but earlier counts stay.
            assert fragments == [one.fragments for one in passes]
        else:
            tracer.trace(origins, directions)
        kernels = sum(kinds == {"samples": True} for kinds in made)
        assert kernels <= len(tracer.method.kernels) < tracer.statistics.queries / 4
