"""A packet method writes its hits in one of two layouts: arrays for the caller, or textures with
an entry per ray for later passes. Both layouts have the same hits."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import assert_same_bits, soup_scene

import gpgpu_rt as rt

PACKETS = [(1, 1), (2, 1), (2, 2), (4, 2), (4, 4)]


@pytest.mark.parametrize("method", ["bvh-packet", "kd-packet"])
@pytest.mark.parametrize("size", [(16, 16), (13, 7)], ids="{0[0]}x{0[1]}".format)
@pytest.mark.parametrize("packet", PACKETS, ids="{0[0]}x{0[1]}".format)
def test_arrays_and_passes_get_the_same_hits(precise_renderer, method: str,
                                             packet: tuple[int, int], size: tuple[int, int]
                                             ) -> None:
    """All hits equal the hits of brute force. This also holds if statistics need the textures with
    an entry per ray, and if packets extend beyond the image."""
    scene = soup_scene(500, 5)
    rays = scene.camera.rays(size)
    with rt.Tracer(scene, "brute-force") as tracer:
        expected = tracer.trace(*rays)
    assert 0 < expected.hit.sum() < len(expected)
    for statistics in (False, True):
        with rt.Tracer(scene, method, packet=packet, statistics=statistics) as tracer:
            assert_same_bits(expected, tracer.trace(*rays))
            assert (tracer.occluded(*rays) == expected.hit).all()


@pytest.mark.parametrize("packet", PACKETS, ids="{0[0]}x{0[1]}".format)
def test_each_stopped_ray_is_counted(precise_renderer, packet: tuple[int, int]) -> None:
    """A ray that reaches the step cap is counted as stopped, wherever it lies in its packet. All
    rays aim at the middle of the scene, and all but one have an empty interval."""
    scene = soup_scene(500, 6)
    origins = np.repeat(np.float32([scene.camera.eye]), 16, axis=0)
    directions = np.mean(scene.bounds, axis=0, dtype=np.float32) - origins
    with rt.Tracer(scene, "bvh-packet", packet=packet, step_cap=1) as tracer:
        for ray in range(16):
            t_max = np.full(16, -1, np.float32)
            t_max[ray] = np.inf
            hits = tracer.trace(origins, directions, t_max=t_max, shape=(4, 4))
            assert (hits.status == 2 * (np.arange(16) == ray)).all()
            assert tracer.statistics.stopped == 1
