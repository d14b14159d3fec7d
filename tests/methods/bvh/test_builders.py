"""Builders: grid cells and kd-tree leaves list every triangle that has a point in them, BVHs hold
all triangles, and the cache keeps each build."""
from __future__ import annotations

import functools

import numpy as np
import pytest
import trimesh
from conftest import assert_threaded, random_soup

import gpgpu_rt as rt
from gpgpu_rt.accel.cache import cached
from gpgpu_rt.methods.bvh.build import build_bvh
from gpgpu_rt.methods.grid.cells import build_grid
from gpgpu_rt.methods.grid.proximity import proximity_cloud
from gpgpu_rt.methods.kdtree.build import build_kdtree

MESHES = {
    "soup": lambda: random_soup(500, 1),
    "ball": lambda: np.float32(trimesh.creation.icosphere(subdivisions=3).triangles),
    "flat": lambda: random_soup(200, 2) * np.float32([1, 0, 1]),
    "slivers": lambda: random_soup(100, 3) * np.float32([1, 1e-6, 1]),
    "coincident": lambda: np.repeat(random_soup(2, 4)[1:], 1000, axis=0),
    "far": lambda: random_soup(200, 5) + np.float32([1e5, -3e4, 2e4]),
    "points": lambda: np.repeat(random_soup(50, 6)[:, :1], 3, axis=1),
    "one": lambda: random_soup(1, 7),
    "empty": lambda: np.zeros((0, 3, 3), np.float32),
}
BUILDS = ("sah", "kay-kajiya", "goldsmith-salmon", "lbvh", "hybrid")
mesh = pytest.mark.parametrize("name", MESHES)


def points_on(triangles: np.ndarray, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return (count, 3) points on triangles in float64, and the index of each point's triangle.

    A third of the points are corners.
    """
    rng = np.random.default_rng(seed)
    chosen = rng.integers(len(triangles), size=count)
    weights = rng.dirichlet((0.5, 0.5, 0.5), count)
    weights[::3] = np.eye(3)[rng.integers(3, size=len(weights[::3]))]
    return np.einsum("nk,nkc->nc", weights, triangles[chosen].astype(float)), chosen


def listed(runs: np.ndarray, references: np.ndarray, start: np.ndarray, end: np.ndarray,
           triangles: np.ndarray) -> np.ndarray:
    """Return, for each i, whether the list ``runs[i]`` contains the triangle ``triangles[i]``.
    The list r of a cell or a leaf is ``references[start[r]:end[r]]``."""
    return np.array([t in references[start[r]:end[r]] for r, t in zip(runs, triangles)])


@mesh
def test_grid_lists_triangles_with_a_point_in_a_cell(name: str) -> None:
    triangles = MESHES[name]()
    grid = build_grid(triangles)
    assert len(grid.cell_start) == np.prod(grid.resolution) + 1
    assert (np.diff(grid.cell_start) >= 0).all() and grid.cell_start[-1] == len(grid.references)
    if not len(triangles):
        return
    points, chosen = points_on(triangles, 600, 8)
    cell = np.clip(((points - grid.lo) / grid.cell_size).astype(int), 0, grid.resolution - 1)
    index = cell @ [1, grid.resolution[0], grid.resolution[0] * grid.resolution[1]]
    assert listed(index, grid.references, grid.cell_start[:-1], grid.cell_start[1:], chosen).all()


@pytest.mark.parametrize("resolution", [1, 7, (3, 1, 9)])
def test_proximity_is_the_chebyshev_distance(resolution) -> None:
    grid = build_grid(random_soup(4, 9, size=0.02), resolution=resolution)
    shape = tuple(grid.resolution)
    occupied = np.argwhere((np.diff(grid.cell_start) > 0).reshape(shape[::-1]))
    cells = np.argwhere(np.ones(shape[::-1], bool))
    expected = np.abs(cells[:, None] - occupied[None]).max(2).min(1)
    assert (proximity_cloud(grid) == expected).all()


@pytest.mark.parametrize("options", [{"split": "binned"}, {"split": "exact"}, {"build": "zhou"},
                                     {"build": "zhou", "small": 5}, {"build": "hybrid"},
                                     {"build": "hybrid", "morton_bits": 4}], ids=str)
@mesh
def test_kdtree_lists_triangles_with_a_point_in_a_leaf(name: str, options: dict) -> None:
    triangles = MESHES[name]()
    tree = build_kdtree(triangles, **options)
    inner = np.flatnonzero(tree.axis < 3)
    parents = tree.parents()
    assert parents[0] == -1 and (parents[tree.left[inner]] == inner).all()
    assert (parents[tree.left[inner] + 1] == inner).all()
    lo, hi = tree.boxes()
    axis = tree.axis[inner]
    assert (hi[tree.left[inner], axis] == tree.split[inner]).all()
    assert (lo[tree.left[inner] + 1, axis] == tree.split[inner]).all()
    if not len(triangles):
        return
    points, chosen = points_on(triangles, 500, 10)
    for side in (0, 1):    # points in a split plane lie in both children
        node = np.zeros(len(points), int)
        for _ in range(tree.depth + 1):
            at = np.flatnonzero(tree.axis[node] < 3)
            value = points[at, tree.axis[node[at]]]
            right = value >= tree.split[node[at]] if side else value > tree.split[node[at]]
            node[at] = tree.left[node[at]] + right
        assert (tree.axis[node] == 3).all()
        assert listed(node, tree.references, tree.left, tree.left + tree.count, chosen).all()


@pytest.mark.parametrize("build", BUILDS)
@mesh
def test_bvh_is_a_threaded_tree(name: str, build: str) -> None:
    triangles = MESHES[name]()
    assert_threaded(build_bvh(triangles, build=build), triangles)


def test_builds_of_coincident_triangles_end() -> None:
    heap = np.repeat(random_soup(1, 3), 10_000, axis=0)
    assert build_kdtree(heap).depth < 40
    assert len(build_kdtree(heap, build="zhou").references) <= 80_000
    assert build_bvh(heap, build="kay-kajiya").depth < 40


@pytest.mark.parametrize("build", [build_grid, build_kdtree, build_bvh])
def test_cache(build, tmp_path, monkeypatch) -> None:
    """The cache returns a stored build. New triangles, and a damaged file, lead to a new build."""
    monkeypatch.setenv("GPGPU_RT_CACHE", str(tmp_path))
    triangles = random_soup(80, 12)
    calls = []

    @functools.wraps(build)
    def counting(given, **options):
        calls.append(1)
        return build(given, **options)
    first = cached(counting, triangles)
    again = cached(counting, triangles)
    assert len(calls) == 1
    for name, value in vars(first).items():
        assert np.array_equal(getattr(again, name), value)
    file, = tmp_path.glob("*.npz")
    for damage in (lambda b: b[:len(b) // 2], lambda b: b"",
                   lambda b: b[:200] + b"\0" * 64 + b[264:]):
        file.write_bytes(damage(file.read_bytes()))
        cached(counting, triangles)
    assert len(calls) == 4
    cached(counting, triangles + np.float32(1))
    assert len(calls) == 5


def test_unknown_options() -> None:
    with pytest.raises(rt.OptionError, match="sah"):
        build_bvh(random_soup(3, 1), build="saah")
    with pytest.raises(rt.OptionError):
        build_kdtree(random_soup(3, 1), binz=3)
