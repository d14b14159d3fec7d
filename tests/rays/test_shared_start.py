"""Shared start: if all rays of a call have the same origin and the same t_min of 0 or more,
programs read origin and t_min from a uniform. The hits stay the same."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import assert_same_bits, soup_scene

import gpgpu_rt as rt

CASES = [("bvh-packet", {"interval_test": True, "octants": octants, "quantise_nodes": bits})
         for octants in (False, True) for bits in (None, 16)] + [
    ("bvh-packet", {}), ("kd-packet", {}), ("bvh-threaded", {}), ("bvh-stack", {})]


@pytest.mark.parametrize("t_min", [0.0, -2.0, [0.0, 1.0] * 128])
@pytest.mark.parametrize("method", ["kd-restart", "bvh-packet"])
def test_rays_from_one_point(method: str, t_min) -> None:
    """Programs read the uniform if all rays share an origin and a t_min that is not negative.

    A call with other rays in between does not change the hits. Invalid rays and the padding after
    the last ray stay misses.
    """
    scene = rt.load_scene("cornell")
    origins, directions = (a.reshape(-1, 3) for a in scene.camera.rays((16, 16)))
    apart = origins.copy()
    apart[-1] += np.float32(1)
    with rt.Tracer(scene, method) as tracer:
        first = tracer.trace(origins[:201], directions[:201],
                             t_min=np.broadcast_to(t_min, 256)[:201])
        assert bool(tracer.session.buffers.rays.uniforms()) == (t_min == 0.0)
        other = tracer.trace(apart[-201:], directions[-201:])
        assert not tracer.session.buffers.rays.uniforms()
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


def aimed(scene: rt.Scene, origin: np.ndarray, count: int,
          seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return (h, w, 3) origins and directions of rays from one point towards vertices, and
    towards points on edges.

    Each ray is repeated eight times in a tile of 4x2, so a packet's bounds are as narrow as a ray.
    """
    rng = np.random.default_rng(seed)
    triangles = scene.triangles[rng.integers(len(scene), size=count * count)].astype(np.float64)
    along = rng.choice([0, 0, 0.25, 0.5], count * count)[:, None]
    target = triangles[:, 0] * (1 - along) + triangles[:, 1] * along
    directions = np.float32(target - origin).reshape(count, count, 3)
    directions = directions.repeat(2, axis=0).repeat(4, axis=1)
    return np.broadcast_to(np.float32(origin), directions.shape), directions


@pytest.mark.parametrize("place", [(0.1, 0.2, 0.3), (3, 0.5, -2), (0, 0, 40)], ids=str)
@pytest.mark.parametrize("seed", [1, 2], ids="seed{}".format)
@pytest.mark.parametrize("method, options", CASES)
def test_aimed_rays_from_one_point(precise_renderer, method: str, options: dict, seed: int,
                                   place: tuple[float, float, float]) -> None:
    """Rays from one point, aimed at vertices and edges, have the hits of brute force."""
    scene = soup_scene(2000, seed)
    rays = aimed(scene, np.array(place, float), 64, seed)
    if "packet" in method:
        options = {**options, "packet": (4, 2)}
    found = []
    for name, own in (("brute-force", {}), (method, options)):
        with rt.Tracer(scene, name, **own) as tracer:
            found.append(tracer.trace(*rays))
    assert found[0].hit.mean() > 0.5
    assert_same_bits(*found)
