"""Grid cells and kd-tree leaves list all triangles that overlap them. `check_lists` says which
other triangles a list may hold.

The oracle clips each triangle against the six planes of the box, in float64.
"""
from __future__ import annotations

import numpy as np
import pytest
from conftest import random_soup
from hypothesis import given, settings
from hypothesis import strategies as st

from gpgpu_rt.accel.bounds import padding
from gpgpu_rt.methods.grid.cells import build_grid
from gpgpu_rt.methods.kdtree.build import build_kdtree
from gpgpu_rt.methods.quality import quality

# Integer corners often give coplanar, coincident, edge-on and zero-area triangles.
LATTICE = st.lists(st.tuples(*[st.integers(-2, 2)] * 9), min_size=1, max_size=9).map(
    lambda rows: np.float32(rows).reshape(-1, 3, 3))
several = settings(max_examples=60, deadline=None, derandomize=True)


def reaches(triangle: np.ndarray, lo: np.ndarray, hi: np.ndarray) -> bool:
    """Return whether any part of the triangle lies in the closed box."""
    polygon = [np.asarray(corner, float) for corner in triangle]
    for axis in range(3):
        for sign, bound in ((1, lo[axis]), (-1, -hi[axis])):
            ahead = [sign * corner[axis] - bound for corner in polygon]
            kept = []
            for i, corner in enumerate(polygon):
                j = i - 1
                if (ahead[i] < 0) != (ahead[j] < 0):
                    s = ahead[i] / (ahead[i] - ahead[j])
                    kept.append(corner + s * (polygon[j] - corner))
                if ahead[i] >= 0:
                    kept.append(corner)
            polygon = kept
    return bool(polygon)


def check_lists(triangles: np.ndarray, lo: np.ndarray, hi: np.ndarray, start: np.ndarray,
                end: np.ndarray, references: np.ndarray, boxed: bool = False) -> None:
    """Assert that each box lists every triangle that overlaps the box.

    A listed triangle must overlap the box widened by six times `padding` (accel/bounds.py).
    With ``boxed``, it is enough if the bounding box of the triangle overlaps the widened box.
    """
    slack = 6 * float(padding(triangles))
    lo, hi = lo.astype(float), hi.astype(float)
    least, most = triangles.min(1).astype(float), triangles.max(1).astype(float)
    for box in range(len(lo)):
        run = references[start[box]:end[box]]
        assert (np.diff(run) > 0).all(), "a list is not in ascending order"
        for t in range(len(triangles)):
            if (least[t] > hi[box] + slack).any() or (most[t] < lo[box] - slack).any():
                assert t not in run
            elif boxed and t in run:
                pass
            elif t in run:
                assert reaches(triangles[t], lo[box] - slack, hi[box] + slack), (box, t, "outside")
            else:
                assert not reaches(triangles[t], lo[box], hi[box]), (box, t, "not listed")


def check_grid(triangles: np.ndarray, resolution) -> None:
    grid = build_grid(triangles, resolution=resolution)
    rx, ry, rz = grid.resolution
    z, y, x = np.indices((rz, ry, rx)).reshape(3, -1)
    size = (grid.hi.astype(float) - grid.lo) / grid.resolution
    lo = grid.lo + np.stack([x, y, z], 1) * size
    check_lists(triangles, lo, lo + size, grid.cell_start[:-1], grid.cell_start[1:],
                grid.references)


def check_kdtree(triangles: np.ndarray, **options) -> None:
    tree = build_kdtree(triangles, **options)
    lo, hi = tree.boxes()
    leaf = tree.axis == 3
    assert (lo <= hi).all()
    check_lists(triangles, lo[leaf], hi[leaf], tree.left[leaf], (tree.left + tree.count)[leaf],
                tree.references, boxed=options.get("build") == "zhou")


@several
@given(LATTICE, st.tuples(*[st.integers(1, 5)] * 3))
def test_grid_on_a_lattice(triangles: np.ndarray, resolution: tuple[int, int, int]) -> None:
    check_grid(triangles, resolution)


@several
@given(LATTICE, st.sampled_from(["binned", "exact"]), st.sampled_from([0.2, 0.9]))
def test_kdtree_on_a_lattice(triangles: np.ndarray, split: str, bonus: float) -> None:
    check_kdtree(triangles, split=split, empty_bonus=bonus, intersection_cost=20)


@several
@given(LATTICE, st.integers(1, 4), st.sampled_from([0, 2, 20]))
def test_hybrid_on_a_lattice(triangles: np.ndarray, bits: int, max_depth: int) -> None:
    check_kdtree(triangles, build="hybrid", morton_bits=bits, max_depth=max_depth,
                 intersection_cost=20)


@settings(several, max_examples=15)
@given(LATTICE, st.sampled_from([1, 2, 4, 64]), st.sampled_from([0.0, 0.25, 1.0]))
def test_zhou_on_a_lattice(triangles: np.ndarray, small: int, empty_cut: float) -> None:
    check_kdtree(triangles, build="zhou", small=small, empty_cut=empty_cut, intersection_cost=20)


@pytest.mark.parametrize("seed", [21, 22])
def test_soup(seed: int) -> None:
    """The lists of a grid and of kd-trees are right for random triangles."""
    triangles = random_soup(60, seed)
    check_grid(triangles, 6)
    check_kdtree(triangles, bins=4)
    check_kdtree(triangles, build="zhou", small=seed % 10, max_depth=12)


@pytest.mark.parametrize("axis", range(3))
def test_flat_triangle_in_a_split_plane_is_on_both_sides(axis: int) -> None:
    wall = np.zeros((1, 3, 3), np.float32)
    wall[0, :, (axis + 1) % 3] = [-1, 1, 0]
    wall[0, :, (axis + 2) % 3] = [-1, -1, 1]
    tree = build_kdtree(wall, empty_bonus=0.9, intersection_cost=100)
    lo, hi = tree.boxes()
    holds = (tree.axis == 3) & (tree.count > 0)
    assert holds.any()
    assert (lo[holds, axis] < 0).all() and (hi[holds, axis] > 0).all()


def test_unclipped_kdtree_lists_triangles_by_their_boxes() -> None:
    """Without clipping, each leaf lists every triangle whose bounding box overlaps the leaf."""
    triangles = random_soup(200, 23)
    clipped = build_kdtree(triangles, max_depth=12)
    boxes = build_kdtree(triangles, max_depth=12, clip=False)
    assert quality(boxes)["sah_cost"] > quality(clipped)["sah_cost"]
    lo, hi = boxes.boxes()
    for node in np.flatnonzero(boxes.axis == 3):
        run = boxes.references[boxes.left[node]:boxes.left[node] + boxes.count[node]]
        for t in np.setdiff1d(np.arange(len(triangles)), run):
            least, most = triangles[t].min(0), triangles[t].max(0)
            assert (least > hi[node]).any() or (most < lo[node]).any()
