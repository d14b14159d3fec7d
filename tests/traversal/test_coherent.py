"""Vertex culling and coherent grid traversal lose no hit. Vertex culling also reduces the number
of triangle tests."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import RAY_SETS, assert_same_bits, random_soup, soup_scene

import gpgpu_rt as rt

PACKET = (4, 2)


def bundles(side: int, seed: int, aim: np.ndarray, spread: float) -> tuple[np.ndarray, ...]:
    """Returns origins and directions of an image, (side, side, 3) each, with one bundle of rays
    per packet.

    The rays of a bundle start at one point, or at points ``spread`` apart. The rays aim at points
    ``spread`` apart around one point of ``aim``. In every fifth bundle, the directions lie around
    the border between two dominant axes.
    """
    rng, count = np.random.default_rng(seed), side * side
    y, x = np.divmod(np.arange(count), side)
    bundle = y // PACKET[1] * (side // PACKET[0]) + x // PACKET[0]
    some = rng.integers(0, len(aim), count)[bundle]
    towards = aim[some] + spread * rng.normal(size=(count, 3))
    towards[::8] = aim[some[::8]]
    origins = (3 * rng.normal(size=(count, 3)))[bundle] + 0.5
    origins += (spread * (bundle % 2))[:, None] * rng.normal(size=(count, 3))
    directions = towards - origins
    between = bundle % 5 == 0
    origins[between] = aim[some[between]] - np.float32([2, 2, 0.1])
    directions[between] = np.float32([1, 1, 0.05]) + spread * rng.normal(size=(between.sum(), 3))
    return tuple(a.astype(np.float32).reshape(side, side, 3) for a in (origins, directions))


def scene_and_aim(seed: int, count: int) -> tuple[rt.Scene, np.ndarray]:
    """Returns a soup, and points at its corners and on its edges. If rays aim at such points, the
    sides of a packet's frustum pass through corners and edges."""
    corners = random_soup(count, seed)
    return soup_scene(count, seed), np.concatenate([
        corners.reshape(-1, 3), (0.3 * corners[:, 0] + 0.7 * corners[:, 1])])


@pytest.mark.parametrize("seed", [1, 2], ids="seed{}".format)
@pytest.mark.parametrize("spread", [0.0, 1e-3, 0.3])
@pytest.mark.parametrize("method, option", [
    ("bvh-packet", "vertex_culling"), ("kd-packet", "vertex_culling"), ("grid", None)])
def test_no_hit_is_lost(precise_renderer, method: str, option: str | None, spread: float,
                        seed: int) -> None:
    scene, aim = scene_and_aim(seed, 200)
    rays = bundles(64, seed, aim, spread)
    with rt.Tracer(scene, "brute-force") as tracer:
        expected = tracer.trace(*rays)
    options = {option: True} if option else {}
    with rt.Tracer(scene, method, packet=PACKET, **options) as tracer:
        hits = tracer.trace(*rays)
        assert not hits.status.any()
        assert_same_bits(hits, expected)
        assert (tracer.occluded(*rays) == expected.hit).all()


@pytest.mark.full
@pytest.mark.parametrize("seed", [5], ids="seed{}".format)
@pytest.mark.parametrize("method, option", [
    ("bvh-packet", "vertex_culling"), ("kd-packet", "vertex_culling"), ("grid", None)])
def test_no_ray_of_a_million_is_lost(precise_renderer, method: str, option: str | None,
                                     seed: int) -> None:
    scene, aim = scene_and_aim(seed, 2000)
    parts = [bundles(512, seed + k, aim, spread)
             for k, spread in enumerate((0.0, 1e-5, 1e-3, 0.03))]
    rays = [np.concatenate(part) for part in zip(*parts)]
    with rt.Tracer(scene, "bvh-threaded") as tracer:
        expected = tracer.trace(*rays)
    options = {option: True} if option else {}
    with rt.Tracer(scene, method, packet=PACKET, **options) as tracer:
        assert_same_bits(tracer.trace(*rays), expected)


@pytest.mark.parametrize("octants", [False, True])
@pytest.mark.parametrize("seed", [3], ids="seed{}".format)
def test_culling_saves_tests_and_nothing_else(seed: int, octants: bool) -> None:
    scene, counted = soup_scene(2000, seed, size=0.05), []
    origins, directions = scene.camera.rays((128, 128))
    for on in (False, True):
        with rt.Tracer(scene, "bvh-packet", octants=octants, vertex_culling=on,
                       statistics=True) as tracer:
            counted.append(tracer.trace(origins, directions))
    plain, culled = counted
    assert (plain.nodes_visited == culled.nodes_visited).all()
    assert (plain.leaves_visited == culled.leaves_visited).all()
    assert (culled.triangles_tested <= plain.triangles_tested).all()
    assert culled.triangles_tested.sum() < 0.8 * plain.triangles_tested.sum()


@pytest.mark.parametrize("seed", [4], ids="seed{}".format)
def test_a_packet_fetches_each_cell_once(precise_renderer, seed: int) -> None:
    """A packet fetches each cell once for all its rays. A single ray fetches its own cells."""
    scene, cells = soup_scene(2000, seed, size=0.05), []
    origins, directions = scene.camera.rays((128, 128))
    for packet in ((1, 1), (4, 4)):
        with rt.Tracer(scene, "grid", packet=packet, statistics=True) as tracer:
            hits = tracer.trace(origins, directions)
        # Each ray counts all cells of its packet, so divide by the packet's number of rays.
        cells.append(hits.nodes_visited.mean() / (packet[0] * packet[1]))
    assert cells[1] < 0.5 * cells[0]


@pytest.mark.parametrize("seed", [6], ids="seed{}".format)
@pytest.mark.parametrize("resolution", [1, (1, 7, 40), 64])
def test_any_resolution(precise_renderer, resolution: object, seed: int) -> None:
    scene = soup_scene(150, seed)
    for kind in ("eye", "random"):
        rays = RAY_SETS[kind](scene, 1024, seed)
        with rt.Tracer(scene, "brute-force") as tracer:
            expected = tracer.trace(*rays)
        with rt.Tracer(scene, "grid", packet=(2, 2), resolution=resolution) as tracer:
            assert_same_bits(tracer.trace(*rays), expected)


@pytest.mark.parametrize("seed", [7], ids="seed{}".format)
@pytest.mark.parametrize("statistics", [False, True])
def test_rays_that_a_packet_leaves_unfinished(precise_renderer, monkeypatch, statistics: bool,
                                              seed: int) -> None:
    """If a packet reaches its limit on steps, its live rays are traced as single rays, and no hit
    is lost."""
    scene = soup_scene(200, seed)
    rays = RAY_SETS["random"](scene, 1024, seed)
    with rt.Tracer(scene, "brute-force") as tracer:
        expected = tracer.trace(*rays)
    with rt.Tracer(scene, "grid", packet=PACKET, step_cap=20) as tracer:
        assert (tracer.trace(*rays).status == 2).any()
    monkeypatch.setattr("gpgpu_rt.traversal.packets.PACKET_STEPS", 20)
    with rt.Tracer(scene, "grid", packet=PACKET, statistics=statistics) as tracer:
        hits = tracer.trace(*rays)
        assert not hits.status.any()
        assert_same_bits(hits, expected)


@pytest.mark.full
@pytest.mark.parametrize("seed", [8], ids="seed{}".format)
@pytest.mark.parametrize("precision", ["fp24", "fp16"])
@pytest.mark.parametrize("method", ["bvh-packet", "kd-packet"])
def test_culling_loses_nothing_in_lower_precision(precise_renderer, method: str, precision: str,
                                                  seed: int) -> None:
    scene, aim = scene_and_aim(seed, 100)
    rays, answers = bundles(32, seed, aim, 1e-2), []
    for on in (False, True):
        with rt.Tracer(scene, method, precision=precision, packet=PACKET,
                       vertex_culling=on) as tracer:
            answers.append(tracer.trace(*rays))
    assert answers[0].hit.any()
    assert_same_bits(*answers)


@pytest.mark.parametrize("method, options, word", [
    ("bvh-packet", {"vertex_culling": True, "intersection": "plucker"}, "watertight"),
    ("kd-packet", {"vertex_culling": True, "intersection": "moller-trumbore"}, "watertight"),
    ("bvh-packet", {"vertex_culling": True, "schedule": "step"}, "loop only"),
    ("grid", {"packet": (2, 2), "schedule": "kernels"}, "packet=2x2 runs under loop only")])
def test_combinations_that_are_refused(method: str, options: dict, word: str) -> None:
    with pytest.raises(rt.OptionError, match=word) as caught:
        rt.Tracer(soup_scene(9, 1), method, **options)
    assert "\n" not in str(caught.value)
