"""softpipe restarts gl_VertexID at 0 after every 4,096 vertices. In the past, programs therefore
scattered all later points to the texels of the first 4,096 points."""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt

RAYS = 5000


@pytest.mark.small
@pytest.mark.parametrize("method, options", [
    ("grid", {"sort_rays": True}), ("ray-tiles", {}), ("ray-hierarchy", {})])
def test_more_points_than_are_numbered(method: str, options: dict) -> None:
    rng = np.random.default_rng(7)
    scene = rt.Scene.from_arrays(rng.random((240, 3)), np.arange(240).reshape(-1, 3))
    origins, directions = rng.random((2, RAYS, 3))
    with rt.Tracer(scene, "brute-force") as tracer:
        expected = tracer.trace(origins, directions - 0.5)
    with rt.Tracer(scene, method, **options) as tracer:
        hits = tracer.trace(origins, directions - 0.5)
    assert (hits.triangle == expected.triangle).all() and (hits.t == expected.t).all()
    assert RAYS > expected.hit.sum() > RAYS // 20
