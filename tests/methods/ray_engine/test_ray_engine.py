"""The Ray Engine: quads cover their rays, the host walks cells as the method `grid` does, and the
hits do not depend on the size of batches.

Further tests bound the errors of a 24-bit depth buffer and check the reported transfers.
"""
from __future__ import annotations

import json

import numpy as np
import pytest
from conftest import RAY_SETS, assert_same_bits, random_soup, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.cli.main import main
from gpgpu_rt.conform.families import make_case
from gpgpu_rt.figures.experiments import sheets
from gpgpu_rt.methods.ray_engine import driver as ray_engine
from gpgpu_rt.methods.ray_engine.quads import WIDTH, Runs


@pytest.mark.parametrize("seed", [1, 2], ids="seed{}".format)
def test_rectangles_cover_each_ray_of_a_run_once(seed: int) -> None:
    rng = np.random.default_rng(seed)
    counts = np.concatenate([rng.choice([1, 2, 7, WIDTH - 1, WIDTH, WIDTH + 1, 5 * WIDTH], 200),
                             rng.integers(1, 40, 200)])
    runs = Runs.of(np.repeat(np.arange(400) * 3, counts))
    assert (runs.count == counts).all() and (runs.cell == np.arange(400) * 3).all()
    corners, owner = runs.rectangles()
    covered = np.zeros(-(-counts.sum() // WIDTH) * WIDTH, int)
    found = np.full(len(covered), -1)
    for (x0, y0, x1, y1), run in zip(corners.astype(int), owner):
        assert x0 < x1 <= WIDTH and y0 < y1
        covered.reshape(-1, WIDTH)[y0:y1, x0:x1] += 1
        found.reshape(-1, WIDTH)[y0:y1, x0:x1] = run
    assert (covered[:counts.sum()] == 1).all() and not covered[counts.sum():].any()
    assert (found[:counts.sum()] == np.repeat(np.arange(400), counts)).all()


@pytest.mark.parametrize("seed", [3], ids="seed{}".format)
@pytest.mark.parametrize("kind", ["eye", "random", "surface"])
def test_the_host_walks_as_the_grid_does(precise_renderer, kind: str, seed: int) -> None:
    """The host visits the same cells and tests the same triangles as the fragments of `grid`."""
    scene = soup_scene(500, seed, size=0.05)
    rays = RAY_SETS[kind](scene, 400, seed)
    counted = []
    for method in ("grid", "ray-engine"):
        with rt.Tracer(scene, method, density=2.0, statistics=True) as tracer:
            counted.append(tracer.trace(*rays))
    assert_same_bits(*counted)
    assert counted[0].nodes_visited.max() > 5
    for name in ("nodes_visited", "leaves_visited", "triangles_tested"):
        assert (getattr(counted[0], name) == getattr(counted[1], name)).all(), name


@pytest.mark.parametrize("seed", [3], ids="seed{}".format)
@pytest.mark.parametrize("kind", ["eye", "random", "surface"])
def test_an_octree_saves_cells(precise_renderer, kind: str, seed: int) -> None:
    """If most triangles are in one corner, large octree cells fill the rest of the scene, and rays
    visit fewer cells than in a grid."""
    triangles = np.concatenate([random_soup(800, seed, size=0.05) * np.float32(0.1),
                                random_soup(20, seed, size=0.5)])
    scene = rt.Scene.from_arrays(triangles.reshape(-1, 3), np.arange(2460).reshape(-1, 3))
    rays = RAY_SETS[kind](scene, 625, seed)
    counted = []
    for cells in ("grid", "octree"):
        with rt.Tracer(scene, "ray-engine", cells=cells, statistics=True) as tracer:
            counted.append(tracer.trace(*rays))
    assert_same_bits(*counted)
    few, many = (hits.nodes_visited.sum() for hits in reversed(counted))
    assert few < 0.8 * many


@pytest.mark.parametrize("seed", [4], ids="seed{}".format)
@pytest.mark.parametrize("options", [
    {"batch": 1, "queue": 1}, {"batch": 300}, {"queue": 1}, {
        "queue": 10_000}, {"cpu_below": 8, "resolution": 3},
    {"cells": "octree", "leaf_size": 1}, {"cells": "octree", "batch": 77, "queue": 1},
    {"cells": "octree", "leaf_size": 200},
    {"cpu_below": 10_000}, {"resolution": 1}, {"resolution": 1, "batch": 77}],
    ids=lambda options: "-".join(f"{k}{v}" for k, v in options.items()))
def test_batches_do_not_change_hits(exact_renderer, options: dict, seed: int, monkeypatch) -> None:
    """The hits do not depend on the sizes of batches and queues. The hits are also the same if
    draws are split into short parts."""
    scene = soup_scene(150, seed)
    rays = RAY_SETS["random"](scene, 60 if options.get("batch") == 1 else 600, seed)
    with rt.Tracer(scene, "brute-force") as tracer:
        expected = tracer.trace(*rays)
    with rt.Tracer(scene, "ray-engine", **options) as tracer:
        assert_same_bits(tracer.trace(*rays), expected)
        split = tracer.statistics.split
        assert (split["host_rays"] > 0) == ("cpu_below" in options)
        assert (split["batches"] > 0) == (options.get("cpu_below") != 10_000)
        monkeypatch.setattr(ray_engine, "MOST_QUADS", 40)
        assert_same_bits(tracer.trace(*rays), expected)
        assert (tracer.occluded(*rays) == expected.hit).all()


@pytest.mark.parametrize("seed", [5], ids="seed{}".format)
@pytest.mark.parametrize("exponent, least, most", [
    (-26, 0.65, 0.85), (-25, 0.4, 0.6), (-24, 0.01, 0.2), (-22, 0, 0)])
def test_errors_of_24_bits_of_depth(exponent: int, least: float, most: float, seed: int) -> None:
    """A 24-bit depth buffer confuses two squares if their gap is less than a few steps of depth.

    The share of wrong hits depends on the gap, and a wrong hit is off by at most one step. With
    blending in float32 ("blend"), hits are right up to the rounding of t.
    """
    gap, rounding = sheets.FAR * 2.0**exponent, 2.0**-22
    share, off = sheets.measure(gap, "blend", seed=seed)
    assert share <= 0.01 and off <= rounding
    share, off = sheets.measure(gap, "depth", seed=seed)
    assert least <= share <= most
    assert off <= sheets.FAR * 1.001 * 2.0**-24 + rounding


@pytest.mark.parametrize("seed", [8], ids="seed{}".format)
@pytest.mark.parametrize("name", ["denormals", "slivers", "moved-1e6", "degenerate", "in-planes"])
def test_the_host_intersects_to_the_same_bits(exact_renderer, name: str, seed: int) -> None:
    """Even in extreme cases, the host's intersections give the same bits as the passes."""
    case = make_case(name, 300, seed)
    answers = []
    for options in ({}, {"cpu_below": 10**9}):
        with rt.Tracer(case.scene, "ray-engine", **options) as tracer:
            answers.append(tracer.trace(case.origins, case.directions))
            assert (tracer.statistics.split["batches"] == 0) == bool(options)
    assert_same_bits(*answers)


@pytest.mark.parametrize("options", [{"intersection": "plucker"}, {"storage": "fp16"},
                                     {"arithmetic": "fp24"}], ids=str)
def test_options_that_the_host_lacks_are_refused(options: dict) -> None:
    with pytest.raises(rt.OptionError, match="cpu_below") as caught:
        rt.Tracer(soup_scene(9, 1), "ray-engine", cpu_below=4, **options)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("seed", [6], ids="seed{}".format)
@pytest.mark.parametrize("cpu_below", [0, 12])
def test_the_statistics_count_bytes_and_pairs(cpu_below: int, seed: int) -> None:
    """The bytes and ray-triangle pairs in the statistics agree with the hits' counters."""
    scene = soup_scene(200, seed)
    rays = RAY_SETS["random"](scene, 500, seed)
    with rt.Tracer(scene, "ray-engine", statistics=True, cpu_below=cpu_below) as tracer:
        for _ in range(2):      # the statistics describe the last call only
            hits = tracer.trace(*rays)
        split, spent = tracer.statistics.split, tracer.statistics.trace_seconds
        json.dumps(tracer.statistics.to_dict())
        texels = tracer.session.buffers.rays.size[0] * tracer.session.buffers.rays.size[1]
    batched = hits.leaves_visited.sum() - split["host_rays"]
    assert split["pairs"] == hits.triangles_tested.sum()
    # Each ray is read back once (32 bytes), and its state, hit and counters are uploaded once (48
    # bytes). A batch is padded to whole rows of rays. For each ray, the batch uploads 32 bytes and
    # reads back 16 bytes. For each quad, the batch uploads 20 bytes.
    up = split["bytes_up"] - 48 * texels - 20 * split["quads"]
    down = split["bytes_down"] - 32 * texels
    assert up == 2 * down and down % (16 * WIDTH) == 0
    assert 0 <= down // 16 - batched <= WIDTH * split["batches"]
    seconds = [split[name] for name in split if name.endswith("seconds")]
    assert all(s >= 0 for s in seconds) and 0 < sum(seconds) <= spent


def test_an_octree_has_no_resolution() -> None:
    with pytest.raises(rt.OptionError, match="resolution") as caught:
        rt.Tracer(soup_scene(9, 1), "ray-engine", cells="octree", resolution=4)
    assert "\n" not in str(caught.value)


def test_pictures_are_the_same(precise_renderer) -> None:
    pictures = []
    for method in ("ray-engine", "bvh-threaded"):
        with rt.Tracer("cornell", method) as tracer:
            pictures.append(np.asarray(tracer.render(size=(40, 30))))
    assert (pictures[0] == pictures[1]).all() and pictures[0].std() > 0


def test_render_prints_the_shared_work(tmp_path, capsys) -> None:
    """`gpgpu-rt render` prints how host and graphics card shared the work."""
    assert not main(["render", "cornell", "-m", "ray-engine", "--size", "8x8", "-o",
                     str(tmp_path / "x.png")])
    line = capsys.readouterr().out.splitlines()[-1]
    assert line.startswith("work shared by host and graphics card: traversal ")
    assert "transfer " in line and "bytes down " in line


@pytest.mark.full
@pytest.mark.parametrize("seed", [7], ids="seed{}".format)
@pytest.mark.parametrize("kind", ["random", "edges"])
@pytest.mark.parametrize("cells", ["grid", "octree"])
def test_no_ray_of_a_million_is_lost(precise_renderer, cells: str, kind: str, seed: int) -> None:
    """Neither the walk nor the quads lose a ray: all hits equal those of `bvh-threaded`."""
    scene = soup_scene(1000, seed, size=0.05)
    rays = RAY_SETS[kind](scene, 10**6, seed)
    with rt.Tracer(scene, "bvh-threaded") as tracer:
        expected = tracer.trace(*rays)
    with rt.Tracer(scene, "ray-engine", cells=cells) as tracer:
        assert_same_bits(tracer.trace(*rays), expected)
