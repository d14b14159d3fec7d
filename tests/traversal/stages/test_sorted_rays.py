"""Sorted rays: each hit is returned at the index of its ray, and the order of the rays changes no
bit of a hit."""
from __future__ import annotations

import pickle

import numpy as np
import pytest
import trimesh
from conftest import RAY_SETS, assert_same_bits, real_scene, schedules_of, soup_scene

import gpgpu_rt as rt
from gpgpu_rt import hits
from gpgpu_rt.bench import workloads
from gpgpu_rt.figures.experiments import coherence
from gpgpu_rt.inspect.time_travel import travel
from gpgpu_rt.methods import find_method
from gpgpu_rt.rays.batch import RayBatch

SCENE = soup_scene(80, 7)
OF_NEIGHBOURS = ("ray-tiles", "ray-hierarchy")   # a ray's cost depends on its neighbours
WAYS = ("sort_rays", "presort")
QUICK = ("bvh-threaded-loop", "kd-packet-loop", "ray-tiles-kernels", "kd-texture-stack-step1")


def mixed_rays(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return origins and directions, (37, 29, 3) each; neither side is a multiple of 8.

    Half of the rays are eye rays, half are random, and two rays are invalid.
    """
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
@pytest.mark.parametrize("way", WAYS)
def test_hits_are_the_same(precise_renderer, way: str, method: str, settings: dict, seed: int
                           ) -> None:
    origins, directions = mixed_rays(seed)
    with rt.Tracer(SCENE, method, statistics=True, **settings) as tracer:
        plain = tracer.trace(origins, directions, invalid="miss")
        shadowed = tracer.occluded(origins, directions, 0.7, invalid="miss")
    with rt.Tracer(SCENE, method, statistics=True, **{way: True}, **settings) as tracer:
        for _ in range(2):     # the second call reuses the textures of the first
            got = tracer.trace(origins, directions, invalid="miss")
            assert_same_bits(got, plain)
            assert (got.status == plain.status).all()
        assert 0 < tracer.statistics.sort_seconds < tracer.statistics.trace_seconds
        assert (tracer.occluded(origins, directions, 0.7, invalid="miss") == shadowed).all()
    if not (find_method(method).packet or method in OF_NEIGHBOURS):   # each ray has its own cost
        for name in ("steps", "nodes_visited", "leaves_visited", "triangles_tested"):
            assert (getattr(got, name) == getattr(plain, name)).all(), name


def test_pictures_are_the_same(precise_renderer) -> None:
    """Eye rays have a common origin, and shadow rays do not. The GPU makes both kinds of rays."""
    pictures = []
    for sort_rays in (False, True):
        with rt.Tracer(SCENE, "bvh-threaded", sort_rays=sort_rays) as tracer:
            pictures.append(np.asarray(tracer.render(size=(45, 31))))
    assert (pictures[0] == pictures[1]).all()


@pytest.mark.parametrize("precision", ["fp24", "fp16"])
@pytest.mark.parametrize("way", WAYS)
def test_in_lower_precision(precise_renderer, way: str, precision: str) -> None:
    origins, directions = mixed_rays(2)
    with rt.Tracer(SCENE, "bvh-threaded", precision=precision) as tracer:
        plain = tracer.trace(origins, directions, invalid="miss")
    with rt.Tracer(SCENE, "bvh-threaded", precision=precision, **{way: True}) as tracer:
        assert_same_bits(tracer.trace(origins, directions, invalid="miss"), plain)


@pytest.mark.parametrize("way", WAYS)
def test_each_ray_keeps_its_interval_and_length(precise_renderer, way: str) -> None:
    """Each ray keeps its own interval and the length of its direction. Rays that start far from
    the scene, and rays that the step cap stops, keep their hits and statuses too."""
    origins, directions = (rays.reshape(-1, 3) for rays in mixed_rays(4))
    rng = np.random.default_rng(4)
    directions = directions * np.exp2(rng.integers(-9, 9, (len(directions), 1))).astype(np.float32)
    origins[::7] -= 1e5 * directions[::7]
    ends = (rng.random(len(origins)) * 0.3, 0.5 + rng.random(len(origins)).astype(np.float32))
    found = []
    for options in ({}, {way: True}):
        with rt.Tracer(SCENE, "bvh-threaded", statistics=True, step_cap=9, **options) as tracer:
            found.append(tracer.trace(origins, directions, *ends, invalid="miss"))
            stopped = tracer.statistics.stopped
        assert 0 < stopped == (found[-1].status == hits.UNFINISHED).sum()
    assert_same_bits(*found)
    for name in ("status", "steps", "nodes_visited"):
        assert (getattr(found[0], name) == getattr(found[1], name)).all(), name


def test_few_rays_or_none(precise_renderer) -> None:
    with rt.Tracer(SCENE, "bvh-threaded", presort=True) as tracer:
        for count in (0, 1, 63, 65):
            origins, directions = RAY_SETS["random"](SCENE, 1089, 5)
            got = tracer.trace(origins[:count], directions[:count])
            with rt.Tracer(SCENE, "bvh-threaded") as plain:
                assert_same_bits(got, plain.trace(origins[:count], directions[:count]))


@pytest.mark.parametrize("method, options", [
    ("bvh-threaded", {}), ("bvh-packet", {"packet": (2, 1)}), ("bvh-packet", {"packet": (2, 2)}),
    ("kd-packet", {"packet": (4, 2)}), ("bvh-packet", {"packet": (4, 4)})], ids=str)
def test_all_results_keep_the_callers_order(precise_renderer, method: str, options: dict) -> None:
    """All results are returned at the indices of their rays, whatever the layout of the render
    targets. The sorted order omits rays with an empty interval (t_max < t_min), but these rays get
    results too."""
    origins, directions = RAY_SETS["random"](SCENE, 5000, 9)
    t_max = np.where(np.arange(5000) % 3, np.inf, -1.0)
    found = []
    for presort in (False, True):
        with rt.Tracer(SCENE, method, presort=presort, **options) as tracer:
            hits = tracer.trace(origins, directions, t_max=t_max)
            found.append({**hits.to_dict(), "hidden": tracer.occluded(origins, directions, t_max)})
    assert 0.1 < found[0]["hidden"].mean() < 0.6
    for name, values in found[0].items():
        assert (values == found[1][name]).all(), name


def test_all_hits_and_a_pickled_tracer(precise_renderer) -> None:
    origins, directions = mixed_rays(8)
    with rt.Tracer(SCENE, "kd-packet") as tracer:
        plain = tracer.trace_all(origins, directions, invalid="miss")
    with rt.Tracer(SCENE, "kd-packet", presort=True) as made, \
            pickle.loads(pickle.dumps(made)) as tracer:
        got = tracer.trace_all(origins, directions, invalid="miss")
        assert 0 < tracer.statistics.sort_seconds < tracer.statistics.trace_seconds
    for name in ("ray", "t", "triangle", "status"):
        assert (getattr(got, name) == getattr(plain, name)).all(), name


def test_time_travel_refuses_sorted_rays() -> None:
    with rt.Tracer(SCENE, "grid", schedule="step", presort=True) as tracer, \
            pytest.raises(rt.OptionError, match="presort"):
        travel(tracer, *mixed_rays(6), lambda one: None, invalid="miss")


@pytest.mark.parametrize("seed", [3], ids="seed{}".format)
def test_similar_rays_become_neighbours(seed: int) -> None:
    """64 bundles of 64 rays are shuffled. In the sorted order, each square of 8 x 8 rays is one
    bundle again."""
    rng = np.random.default_rng(seed)
    cells = np.stack(np.meshgrid([0.2, 0.45, 0.7, 0.95], [0.2, 0.6], [0.2, 0.7]), -1)
    cells = cells.reshape(-1, 3)
    ways = np.float32([[1, 0.1, 0.2], [-1, 0.1, 0.2], [0.1, 0.2, 1], [0.2, -1, 0.1]])
    bundle = np.repeat(np.arange(64), 64)
    origins = cells[bundle // 4] + 0.01 * rng.random((4096, 3))
    directions = ways[bundle % 4] + 0.01 * rng.random((4096, 3))
    mixed = rng.permutation(4096)
    with rt.Tracer(SCENE, "bvh-threaded", sort_rays=True) as tracer:
        tracer.trace(origins[mixed], directions[mixed])
        order = tracer.session.driver.order(tracer.session.buffers.rays)
    batch = RayBatch(origins[mixed], directions[mixed])
    batch.put_in_order(SCENE.bounds)
    width, height = batch.size
    lies = batch.texels(0)[..., 0].reshape(height // 8, 8, width // 8, 8).swapaxes(1, 2)
    assert (np.sort(lies.reshape(64, 64)) == np.sort(
        batch.given_fields()["origin"][batch.order.rays, 0].reshape(64, 64))).all()
    for found in (order, batch.order.rays):
        assert (np.sort(found) == np.arange(4096)).all()
        squares = bundle[mixed[found]].reshape(64, 64)
        assert (squares == squares[:, :1]).all()


@pytest.mark.parametrize("way", WAYS)
def test_origins_on_a_plane_or_at_a_point(way: str) -> None:
    """The extent of the origins is 0, or so small that its inverse overflows. The sort then puts
    all origins into one cell, without an error."""
    for start, spread in ((0.5, 0.0), (0.0, 1e-40)):
        origins = np.tile(np.float32([start, start, 3]), (100, 1))
        origins[::2, 0] += np.float32(spread)
        assert np.ptp(origins[:, 0]) == np.float32(spread)
        directions = np.tile(np.float32([0, 0, -1]), (100, 1))
        box = trimesh.creation.box((4, 4, 1)).apply_translation((0.1, 0.3, 0))
        with rt.Tracer(box, "bvh-threaded", **{way: True}) as tracer:
            found = tracer.trace(origins, directions)
        assert (found.triangle == found.triangle[0]).all() and found.hit.all()


@pytest.mark.full
@pytest.mark.parametrize("bounces, size, least", [
    (1, 512, 1.4), (2, 512, 2.0), pytest.param(1, 2048, 2.0, marks=pytest.mark.once)])
def test_tiles_of_scattered_rays_need_fewer_nodes(bounces: int, size: int, least: float) -> None:
    """Sorting gains less at the first bounce than at the second. Neighbouring rays of the first
    bounce start side by side even without sorting, at the hits of neighbouring eye rays. With more
    rays, sorting gains more."""
    real_scene("kitchen")
    found = coherence.measure(workloads.load("kitchen"),
                              workloads.workload("kitchen", workloads.diffuse(bounces), size))
    assert found["distinct_as_they_come"] >= least * found["distinct_sorted"]
