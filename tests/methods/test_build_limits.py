"""Tests of builders: extreme scales, refused coordinates and options, limits of depth, costs of
trees, and the order of triangles in a leaf."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import random_soup, real_scene

import gpgpu_rt as rt
from gpgpu_rt.methods.bvh.build import build_bvh
from gpgpu_rt.methods.grid.cells import build_grid
from gpgpu_rt.methods.kdtree.build import build_kdtree
from gpgpu_rt.methods.quality import quality, sah_cost

BUILDERS = (build_grid, build_kdtree, build_bvh)


@pytest.mark.parametrize("build", BUILDERS)
@pytest.mark.parametrize("scale", [1e-30, 1e-12, 1e15, 1e33])
def test_any_scale_gives_the_same_counts(build, scale: float) -> None:
    """If all coordinates are scaled, a builder makes a structure with about the same number of
    references and the same cost."""
    triangles = random_soup(100, 31)
    plain = quality(build(triangles))
    scaled = quality(build((triangles.astype(float) * scale).astype(np.float32)))
    assert scaled["references"] == pytest.approx(plain["references"], rel=0.1)
    assert scaled["sah_cost"] == pytest.approx(plain["sah_cost"], rel=0.1)


@pytest.mark.parametrize("build", BUILDERS)
def test_a_coordinate_that_is_not_finite_is_named(build) -> None:
    triangles = random_soup(9, 32)
    triangles[[4, 6], 1, 2] = np.nan, np.inf
    with pytest.raises(rt.SceneError, match="triangle 4 "):
        build(triangles)
    with pytest.raises(rt.SceneError, match=r"\(9, 9\)"):
        build(triangles.reshape(9, 9))


@pytest.mark.parametrize("build, wrong", [
    (build_grid, {"resolution": 0}), (build_grid, {"resolution": 513}),
    (build_grid, {"resolution": (1, 2)}), (build_grid, {"resolution": 2.5}),
    (build_grid, {"density": -1}), (build_grid, {"densty": 1}),
    (build_kdtree, {"split": "exactly"}), (build_kdtree, {"bins": 1}),
    (build_kdtree, {"max_depth": -1}), (build_kdtree, {"empty_bonus": 1}),
    (build_kdtree, {"traversal_cost": float("nan")}),
    (build_bvh, {"max_leaf": 0}), (build_bvh, {"seed": 1}),
    (build_bvh, {"build": "kay-kajiya", "axis": "random"}),
    (build_bvh, {"build": "goldsmith-salmon", "seed": -1}),
    (build_bvh, {"build": None}),
])
def test_wrong_options_are_refused(build, wrong: dict) -> None:
    with pytest.raises(rt.OptionError) as refusal:
        build(random_soup(5, 33), **wrong)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("depth", [0, 1, 5])
def test_max_depth_is_kept(depth: int) -> None:
    tree = build_kdtree(random_soup(300, 34), max_depth=depth)
    assert tree.depth == depth
    assert len(tree.axis) <= 2 ** (depth + 1) - 1


def test_a_larger_bonus_still_leaves_a_tree() -> None:
    """A larger `empty_bonus` keeps leaves small. If the bonus also applied to thin empty slices,
    the builder would spend the whole depth on cutting such slices off."""
    triangles = random_soup(3000, 35, size=0.02)
    usual = quality(build_kdtree(triangles))
    eager = quality(build_kdtree(triangles, empty_bonus=0.5))
    assert eager["references_per_leaf"] < 1.5 * usual["references_per_leaf"]
    assert eager["sah_cost"] < 1.2 * usual["sah_cost"]


def test_goldsmith_salmon_follows_its_seed() -> None:
    triangles = random_soup(300, 36)
    trees = [build_bvh(triangles, build="goldsmith-salmon", seed=s) for s in (1, 1, 2)]
    assert np.array_equal(trees[0].order, trees[1].order)
    assert not np.array_equal(trees[0].order, trees[2].order)


def test_sah_costs_less_than_median_and_insertion() -> None:
    """The build `sah` gives a lower SAH cost than median splits (`kay-kajiya`) and shuffled
    insertion (`goldsmith-salmon`)."""
    triangles = np.concatenate([random_soup(300, 37), random_soup(300, 38, 0.01) * 0.1])
    cost = {build: sah_cost(build_bvh(triangles, build=build))
            for build in ("sah", "kay-kajiya", "goldsmith-salmon")}
    assert cost["sah"] < cost["goldsmith-salmon"] and cost["sah"] < cost["kay-kajiya"]


def test_cost_of_trees_by_hand() -> None:
    """The box of both triangles (1 x 1 x 3) has area 14, and the box of each has area 2."""
    corners = np.float32([[0, 0, 0], [1, 1, 0], [0, 1, 0]])
    pair = np.stack([corners, corners + np.float32([0, 0, 3])])
    bvh = build_bvh(pair, max_leaf=1)
    assert bvh.count.tolist() == [0, 1, 1] and bvh.escape.tolist() == [3, 2, 3]
    assert sah_cost(bvh) == pytest.approx(1 + 2 * (1 / 7) * 2)
    assert sah_cost(bvh, intersection_cost=3) == pytest.approx(1 + 2 * (1 / 7) * 4)
    grid = build_grid(pair, resolution=(1, 1, 3))
    assert np.diff(grid.cell_start).tolist() == [1, 0, 1]
    assert sah_cost(grid) == pytest.approx(5 * 3 / 7, rel=1e-4)


@pytest.mark.full
def test_bunny_has_the_leaves_of_figure_17() -> None:
    """The kd-tree of the bunny has about as many leaves as Figure 17 of the survey says."""
    figures = quality(build_kdtree(real_scene("bunny").triangles))
    assert figures["leaves"] == pytest.approx(349_833, rel=0.15)
    assert figures["references_per_leaf"] <= 3.2


@pytest.mark.parametrize("build", ["sah", "goldsmith-salmon"])
def test_triangles_ascend_within_a_leaf(build: str) -> None:
    """The kernels of the era form (docs/era.md) compare only distances. Among triangles at the
    same distance, the triangle that is tested first wins. Within a leaf, the triangle with the
    lowest index must therefore come first."""
    bvh = build_bvh(random_soup(400, 39), build=build)
    leaf = bvh.count > 0
    owner = np.repeat(np.flatnonzero(leaf), bvh.count[leaf])
    falls = np.diff(bvh.order) < 0
    assert not (falls & (np.diff(owner) == 0)).any()
    assert build != "sah" or bvh.count.max() > 1
