"""The corners of a triangle are fetched once for all rays of a packet, and the rays get the same
results as single rays."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import assert_same_bits, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.methods import find_method

SIDE = 32


def fanned(seed: int, one_origin: bool) -> tuple[np.ndarray, np.ndarray]:
    """Returns origins and directions, (SIDE, SIDE, 3), of neighbouring rays with different
    dominant axes."""
    rng = np.random.default_rng(seed)
    origins = 0.5 + 0.2 * rng.normal(size=(1, 1, 3) if one_origin else (SIDE, SIDE, 3))
    directions = 1 + 0.3 * rng.normal(size=(SIDE, SIDE, 3))
    return (np.broadcast_to(origins, directions.shape).astype(np.float32),
            directions.astype(np.float32))


@pytest.mark.parametrize("seed", [1], ids="seed{}".format)
@pytest.mark.parametrize("precision", ["fp32", pytest.param("fp16", marks=pytest.mark.full)])
@pytest.mark.parametrize("one_origin", [True, False], ids=["one-origin", "many-origins"])
@pytest.mark.parametrize("options", [{"packet": (4, 2)}, {
    "packet": (4, 4), "octants": True, "interval_test": True}], ids=["stack", "octants"])
def test_loop_equals_step(precise_renderer, options: dict, one_origin: bool, precision: str,
                          seed: int) -> None:
    """The schedules ``step`` and ``loop`` give the same hits. Under ``step`` each ray fetches the
    corners that it tests; under ``loop`` corners are fetched once for all rays of a packet."""
    scene = soup_scene(300, seed)
    rays = fanned(seed, one_origin)
    axes = np.abs(rays[1]).argmax(2).reshape(SIDE // 2, 2, SIDE // 4, 4)
    assert (np.ptp(axes, axis=(1, 3)) > 0).mean() > 0.5
    found = []
    for schedule in ("step", "loop"):
        with rt.Tracer(scene, "bvh-packet", schedule=schedule, precision=precision,
                       **options) as tracer:
            found.append(tracer.trace(*rays))
            assert (tracer.occluded(*rays) == found[-1].hit).all()
    assert 0.1 < found[0].hit.mean() <= 1
    assert_same_bits(*found)


@pytest.mark.parametrize("seed", [2], ids="seed{}".format)
@pytest.mark.parametrize("one_origin", [True, False], ids=["one-origin", "many-origins"])
@pytest.mark.parametrize("method", [row.name for row in rt.methods() if row.packet and row.single])
def test_packets_equal_single_rays(precise_renderer, method: str, one_origin: bool,
                                   seed: int) -> None:
    """Packets find the hits of the single-ray method over the same structure."""
    scene, rays = soup_scene(300, seed), fanned(seed, one_origin)
    found = []
    for name, options in ((method, {"packet": (4, 2)}), (find_method(method).single, {})):
        with rt.Tracer(scene, name, **options) as tracer:
            found.append(tracer.trace(*rays))
            assert (tracer.occluded(*rays) == found[-1].hit).all()
    assert_same_bits(*found)
