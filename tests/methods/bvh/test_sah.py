"""GPU passes build SAH and hybrid trees. These trees cost hardly more than the CPU's trees, and
every method finds the same hits."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import (
    RAY_SETS, assert_same_bits, assert_threaded, buildable, random_soup, real_scene, soup_scene
)
from shapes import SCENES

import gpgpu_rt as rt
from gpgpu_rt.methods.bvh import lbvh
from gpgpu_rt.methods.bvh.build import build_bvh
from gpgpu_rt.methods.bvh.gpu_build.build import build_bvh_by_passes
from gpgpu_rt.methods.bvh.gpu_build.sah import SMALL
from gpgpu_rt.methods.quality import sah_cost

builds = pytest.mark.parametrize("build", ["sah", "hybrid"])
BUILT = [(row.name, build) for row in rt.methods() for option in row.options
         if option.name == "build" for build in option.choices
         if buildable(row.name, {"build": build, "build_device": "gpu"})]


@builds
@pytest.mark.parametrize("name", SCENES)
def test_trees_are_valid_and_cost_hardly_more_than_the_cpus(gpu, build: str, name: str) -> None:
    triangles = SCENES[name]()
    bvh = build_bvh_by_passes(gpu, triangles, build=build)
    assert_threaded(bvh, triangles)
    assert bvh.count.max() <= 4
    # The costs may differ: passes halve a small node of coincident triangles, whereas the CPU
    # build splits off one triangle at a time.
    expected = build_bvh(triangles, build=build)
    assert sah_cost(bvh) <= 1.05 * sah_cost(expected)


@pytest.mark.parametrize("options", [{"bins": 4}, {"max_leaf": 1}, {"max_leaf": 9},
                                     {"intersection_cost": 3.0, "max_leaf": 8}], ids=str)
@builds
def test_options_have_the_effect_of_the_cpus(gpu, build: str, options: dict) -> None:
    triangles = random_soup(1500, 31)
    one, other = (make(triangles, build=build, **options)
                  for make in (lambda t, **o: build_bvh_by_passes(gpu, t, **o), build_bvh))
    assert_threaded(one, triangles)
    assert one.count.max() == other.count.max()
    assert len(one.count) == pytest.approx(len(other.count), rel=0.02)
    assert sah_cost(one) == pytest.approx(sah_cost(other), rel=0.02)


@pytest.mark.parametrize("max_depth", [0, 12, 17])
def test_max_depth_is_kept(gpu, max_depth: int) -> None:
    triangles = random_soup(1500, 38)
    bvh = build_bvh_by_passes(gpu, triangles, build="sah", max_depth=max_depth)
    assert_threaded(bvh, triangles)
    assert bvh.depth <= max(11, max_depth)


@pytest.mark.parametrize("count", [SMALL // 2, 3 * SMALL])
@pytest.mark.parametrize("axis", range(3))
def test_two_clusters_are_separated_first(gpu, axis: int, count: int) -> None:
    """The first split separates two distant clusters, whose triangles alternate in the array. A
    sweep splits a small node, and bins split a large node, so both sizes are tested."""
    heaps = random_soup(2 * count, 32)
    heaps[::2, :, axis] += 50
    bvh = build_bvh_by_passes(gpu, heaps, build="sah")
    left = bvh.order[:bvh.first[bvh.escape[1]:][bvh.count[bvh.escape[1]:] > 0][0]]
    assert (np.sort(left) == np.arange(1, 2 * count, 2)).all()


def test_hybrid_separates_clusters_as_lbvh_does(gpu) -> None:
    """Nodes above the clusters (triangles of one Morton code) have the same boxes as in LBVH."""
    triangles = random_soup(3000, 33, size=0.02)
    for bits in (1, 2, 4):
        boxes = []
        for bvh in (build_bvh_by_passes(gpu, triangles, build="hybrid", morton_bits=bits),
                    build_bvh(triangles, build="hybrid", morton_bits=bits),
                    build_bvh(triangles, build="lbvh", morton_bits=bits, max_leaf=1)):
            code = lbvh.morton_codes(triangles, bits)[bvh.order]
            leaves = np.cumsum(bvh.count > 0) - (bvh.count > 0)
            start = np.append(bvh.first[bvh.count > 0], len(code))
            first, end = start[leaves], start[np.append(leaves, leaves[-1] + 1)[bvh.escape]]
            above = np.array([code[a:b].min() != code[a:b].max() for a, b in zip(first, end)])
            boxes.append(np.column_stack([bvh.lo, bvh.hi])[above])
        assert len(boxes[0]) > 5
        assert np.array_equal(boxes[0], boxes[1]) and np.array_equal(boxes[0], boxes[2])


@builds
def test_builds_of_coincident_triangles_end(gpu, build: str) -> None:
    bvh = build_bvh_by_passes(gpu, np.repeat(random_soup(1, 34), 5000, axis=0), build=build)
    assert bvh.depth <= 14 and bvh.count.sum() == 5000


@builds
def test_two_builds_of_the_same_triangles_are_equal(gpu, build: str) -> None:
    one, other = (build_bvh_by_passes(gpu, random_soup(2000, 35), build=build) for _ in range(2))
    for name in ("escape", "first", "count", "order", "lo", "hi"):
        assert np.array_equal(getattr(one, name), getattr(other, name))


@pytest.mark.parametrize("method, build", BUILT)
def test_same_hits_from_either_device(precise_renderer, method: str, build: str) -> None:
    scene = soup_scene(700, 36)
    rays = [np.concatenate(both) for both in zip(*(RAY_SETS[kind](scene, 625, 37)
                                                   for kind in ("eye", "random", "edges")))]
    hits = []
    for device in ("cpu", "gpu"):
        with rt.Tracer(scene, method, build=build, build_device=device) as tracer:
            hits.append(tracer.trace(*rays))
    assert hits[0].hit.any()
    assert_same_bits(*hits)


@pytest.mark.parametrize("build, most", [("lbvh", 1.8), ("hybrid", 1.2)])
@pytest.mark.parametrize("name", ["bunny", "kitchen"])
def test_a_ray_takes_few_more_steps_than_in_sah(name: str, build: str, most: float) -> None:
    """On average, a ray takes at most ``most`` times as many steps as in a tree of build `sah`."""
    scene = real_scene(name)
    rays = scene.camera.rays((96, 96))
    steps = {}
    for chosen in ("sah", build):
        with rt.Tracer(scene, "bvh-threaded", build=chosen, statistics=True) as tracer:
            hits = tracer.trace(*rays)
        steps[chosen] = (hits.nodes_visited + hits.triangles_tested).mean()
    assert steps[build] <= most * steps["sah"]


@pytest.mark.full
@builds
@pytest.mark.parametrize("name", ["bunny", "robots", "kitchen"])
def test_trees_of_real_meshes_cost_as_much_as_the_cpus(gpu, name: str, build: str) -> None:
    triangles = real_scene(name).triangles
    bvh = build_bvh_by_passes(gpu, triangles, build=build)
    assert_threaded(bvh, triangles)
    expected = sah_cost(build_bvh(triangles, build=build))
    assert sah_cost(bvh) == pytest.approx(expected, rel=0.01)
