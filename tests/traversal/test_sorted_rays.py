"""Sorted rays: hits come back to where their rays came from, to the bit, whatever the order."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import RAY_SETS, assert_same_bits, real_scene, schedules_of, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.bench import workloads
from gpgpu_rt.figures import coherence
from gpgpu_rt.methods import find_method

SCENE = soup_scene(80, 7)
OF_NEIGHBOURS = ("ray-tiles", "ray-hierarchy")   # what a ray costs depends on those beside it
QUICK = ("bvh-threaded-loop", "kd-packet-loop", "ray-tiles-kernels", "kd-texture-stack-step1")


def mixed_rays(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(37, 29, 3) each, no side a multiple of 8: from one eye and everywhere, a few invalid."""
    eye, anywhere = (RAY_SETS[kind](SCENE, 1089, seed) for kind in ("eye", "random"))
    some = np.random.default_rng(seed).random(1089) < 0.5
    origins, directions = (np.where(some[:, None], a, b)[:37 * 29].reshape(37, 29, 3)
                           for a, b in zip(eye, anywhere))
    origins[5, 6], directions[30, 2] = np.nan, 0
    return origins, directions


@pytest.mark.parametrize("seed", [1], ids="seed{}".format)
@pytest.mark.parametrize("method, settings", [
    pytest.param(row.name, settings, id=f"{row.name}-{name}",
                 marks=() if f"{row.name}-{name}" in QUICK else pytest.mark.full)
    for row in rt.methods() for name, settings in schedules_of(
        row, ("loop", "step1", "kernels")).items()])
def test_hits_are_the_same(exact_renderer, method: str, settings: dict, seed: int) -> None:
    origins, directions = mixed_rays(seed)
    with rt.Tracer(SCENE, method, statistics=True, **settings) as tracer:
        plain = tracer.trace(origins, directions, invalid="miss")
        shadowed = tracer.occluded(origins, directions, 0.7, invalid="miss")
    with rt.Tracer(SCENE, method, statistics=True, sort_rays=True, **settings) as tracer:
        for _ in range(2):     # the second time in textures that are there
            hits = tracer.trace(origins, directions, invalid="miss")
            assert_same_bits(hits, plain)
            assert (hits.status == plain.status).all()
        assert 0 < tracer.statistics.sort_seconds < tracer.statistics.trace_seconds
        assert (tracer.occluded(origins, directions, 0.7, invalid="miss") == shadowed).all()
    if not (find_method(method).packet or method in OF_NEIGHBOURS):   # each ray's own affair
        for name in ("steps", "nodes_visited", "leaves_visited", "triangles_tested"):
            assert (getattr(hits, name) == getattr(plain, name)).all(), name


def test_pictures_are_the_same(exact_renderer) -> None:
    """Eye rays share their origin, shadow rays do not; both are made on the GPU."""
    pictures = []
    for sort_rays in (False, True):
        with rt.Tracer(SCENE, "bvh-threaded", sort_rays=sort_rays) as tracer:
            pictures.append(np.asarray(tracer.render(size=(45, 31))))
    assert (pictures[0] == pictures[1]).all()


@pytest.mark.parametrize("precision", ["fp24", "fp16"])
def test_in_lower_precision(exact_renderer, precision: str) -> None:
    origins, directions = mixed_rays(2)
    with rt.Tracer(SCENE, "bvh-threaded", precision=precision) as tracer:
        plain = tracer.trace(origins, directions, invalid="miss")
    with rt.Tracer(SCENE, "bvh-threaded", precision=precision, sort_rays=True) as tracer:
        assert_same_bits(tracer.trace(origins, directions, invalid="miss"), plain)


@pytest.mark.parametrize("seed", [3], ids="seed{}".format)
def test_rays_that_are_alike_come_together(seed: int) -> None:
    """64 bundles of 64 rays, shuffled: each square of the order is one bundle again."""
    rng = np.random.default_rng(seed)
    cells = np.stack(np.meshgrid([0.2, 0.45, 0.7, 0.95], [
                     0.2, 0.7], [0.2, 0.7]), -1).reshape(-1, 3)
    ways = np.float32([[1, 0.1, 0.2], [-1, 0.1, 0.2], [0.1, 0.2, 1], [0.2, -1, 0.1]])
    bundle = np.repeat(np.arange(64), 64)
    origins = cells[bundle // 4] + 0.01 * rng.random((4096, 3))
    directions = ways[bundle % 4] + 0.01 * rng.random((4096, 3))
    mixed = rng.permutation(4096)
    with rt.Tracer(SCENE, "bvh-threaded", sort_rays=True) as tracer:
        tracer.trace(origins[mixed], directions[mixed])
        order = tracer._traversal.order(tracer._rays)
    assert (np.sort(order) == np.arange(4096)).all()
    squares = bundle[mixed[order]].reshape(64, 64)
    assert (squares == squares[:, :1]).all()


def test_origins_on_a_plane_or_at_a_point() -> None:
    """An extent of nothing, and one whose inverse overflows, are one cell and no error."""
    for spread in (0.0, 1e-40):
        origins = np.float32([0.5, 0.5, 3]) + np.float32(spread) * np.ones((100, 3), np.float32)
        origins[::2, 0] += np.float32(spread)
        directions = np.tile(np.float32([0, 0, -1]), (100, 1))
        with rt.Tracer(SCENE, "bvh-threaded", sort_rays=True) as tracer:
            hits = tracer.trace(origins, directions)
        assert (hits.triangle == hits.triangle[0]).all()


@pytest.mark.full
@pytest.mark.parametrize("bounces, least", [(1, 1.4), (2, 2.0)])
def test_tiles_of_scattered_rays_need_fewer_nodes(bounces: int, least: float) -> None:
    """The first bounce starts where eye rays end, side by side: sorting finds less to mend."""
    real_scene("kitchen")
    found = coherence.measure(workloads.load("kitchen"),
                              workloads.workload("kitchen", workloads.diffuse(bounces), 512))
    assert found["distinct_as_they_come"] >= least * found["distinct_sorted"]
