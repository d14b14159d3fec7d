"""Rays from one point: what they share goes to programs as a uniform, and changes no hit."""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt


@pytest.mark.parametrize("t_min", [0.0, -2.0, [0.0, 1.0] * 128])
@pytest.mark.parametrize("method", ["kd-restart", "bvh-packet"])
def test_rays_from_one_point(method: str, t_min) -> None:
    """What all rays share goes to programs as a uniform: the same hits, also after other rays, and
    rays that are invalid or past the last one stay misses."""
    scene = rt.load_scene("cornell")
    origins, directions = (a.reshape(-1, 3) for a in scene.camera.rays((16, 16)))
    apart = origins.copy()
    apart[-1] += np.float32(1)
    with rt.Tracer(scene, method) as tracer:
        first = tracer.trace(origins[:201], directions[:201],
                             t_min=np.broadcast_to(t_min, 256)[:201])
        assert bool(tracer._rays.uniforms()) == (t_min == 0.0)
        other = tracer.trace(apart[-201:], directions[-201:])
        assert not tracer._rays.uniforms()
        broken = directions[:201].copy()
        broken[7] = np.nan
        third = tracer.trace(origins[:201], broken, t_min=t_min if np.isscalar(t_min) else 0.0,
                             invalid="miss")
    with rt.Tracer(scene, "brute-force") as tracer:
        for hits, rays in ((first, (origins[:201], directions[:201])),
                           (other, (apart[-201:], directions[-201:]))):
            t = np.broadcast_to(t_min, 256)[:201] if hits is first else 0.0
            expected = tracer.trace(*rays, t_min=t)
            assert (hits.triangle == expected.triangle).all() and (hits.t == expected.t).all()
    assert third.triangle[7] == -1 and third.status[7] == 1
