"""`RayOrder` sorts each block of rays separately, or all rays together. A cell, one of the
8 x 8 x 8 parts of the scene's box, is occupied if a ray starts in it. Blocks are sorted separately
if a block occupies, on average, less than three quarters of the cells that all blocks occupy."""
from __future__ import annotations

import numpy as np
import pytest

from gpgpu_rt.rays import order as ray_order
from gpgpu_rt.rays.order import RayOrder
from gpgpu_rt.rays.records import RAY_TEXELS

BOUNDS = (np.zeros(3), np.ones(3))


def planes(origins: np.ndarray, empty: np.ndarray, seed: int) -> list[np.ndarray]:
    """Return the (n, 4) planes of RAY_TEXELS. Directions are random, and the rays in the mask
    ``empty`` have an empty interval."""
    rng = np.random.default_rng(seed)
    fields = {"origin": np.float32(origins), "t_min": np.zeros(len(origins), np.float32),
              "direction": np.float32(rng.uniform(-1, 1, origins.shape)),
              "t_max": np.where(empty, -1, 1).astype(np.float32)}
    texels = RAY_TEXELS.pack(**fields)
    return [np.ascontiguousarray(texels[:, k]) for k in range(RAY_TEXELS.texels)]


def rows_of_a_picture(count: int) -> np.ndarray:
    """Return (n, 3) origins at equal distances along an axis."""
    return np.linspace(0, 0.999, count)[:, None] * [1, 0, 0]


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("share", [0, 0.5, 1], ids="empty-{}".format)
@pytest.mark.parametrize("count", [0, 1, 63, 64, 500])
@pytest.mark.parametrize("scattered", [False, True], ids=["rows", "scattered"])
def test_each_ray_has_one_place_and_is_restored(monkeypatch, scattered: bool, count: int,
                                                share: float, seed: int) -> None:
    """`RayOrder.planes` writes each ray to one place, except rays with an empty interval.
    `RayOrder.back` restores the given order."""
    monkeypatch.setattr(ray_order, "BLOCK", 64)
    rng = np.random.default_rng(seed)
    origins = rng.uniform(0, 1, (count, 3)) if scattered else rows_of_a_picture(count)
    empty = rng.uniform(size=count) < share
    given = planes(origins, empty, seed)
    order = RayOrder(given, BOUNDS)
    assert (np.sort(order.rays) == np.flatnonzero(~empty)).all()
    for plane, laid in zip(given, order.planes(given)):
        assert laid.shape == (order.size[0] * order.size[1], 4)
        assert (order.back(laid)[~empty] == plane[~empty]).all()
    assert (order.back(order.planes(given)[1])[empty, 3] < order.back(
        order.planes(given)[0])[empty, 3]).all()     # empty rays stay empty


@pytest.mark.parametrize("scattered", [False, True], ids=["rows", "scattered"])
@pytest.mark.parametrize("share", [0, 0.3], ids="empty-{}".format)
def test_blocks_with_different_cells_are_sorted_separately(monkeypatch, share: float,
                                                           scattered: bool) -> None:
    """Rays start in eight cells. Blocks are sorted separately if each block's rays start in only
    two of the cells, and together if each block's rays start in all eight."""
    rng = np.random.default_rng(3)
    origins = rows_of_a_picture(4096)
    if scattered:       # every block has rays in all eight cells
        origins = rng.integers(0, 2, (4096, 3)) / 2 + 0.1
    given = planes(origins, rng.uniform(size=4096) < share, 3)
    together = RayOrder(given, BOUNDS).rays
    monkeypatch.setattr(ray_order, "BLOCK", 1024)
    blocks = RayOrder(given, BOUNDS).rays
    assert (blocks == together).all() == scattered
    assert (np.diff(blocks // 1024) >= 0).all() != scattered
    for block in range(4):      # both orders agree within each block
        assert (blocks[blocks // 1024 == block] == together[together // 1024 == block]).all()


@pytest.mark.parametrize("seed", [4, 5], ids="seed{}".format)
def test_neighbours_agree_in_signs_and_dominant_axis(seed: int) -> None:
    """A direction's kind is its three signs and its dominant axis. All rays of a kind lie
    together, and there are 24 kinds, so the kind changes 23 times.

    A packet with several kinds would walk the tree once for each kind.
    """
    given = planes(np.full((5000, 3), 0.5), np.zeros(5000, bool), seed)
    given[1][:100, :3] = np.float32([[1, -1, 0.5], [-0.5, 0.5, 0.5]]).repeat(50, axis=0)    # ties
    directions = given[1][RayOrder(given, BOUNDS).rays, :3]
    kinds = np.stack([*(directions < 0).T, np.abs(directions).argmax(axis=1)], axis=1)
    assert len(np.unique(kinds, axis=0)) == 24
    assert (kinds[1:] != kinds[:-1]).any(axis=1).sum() == 23


@pytest.mark.parametrize("seed", [6], ids="seed{}".format)
def test_rays_of_a_direction_lie_along_a_morton_curve(seed: int) -> None:
    """Among rays of equal direction, the rays from one octant of the box lie together."""
    origins = np.random.default_rng(seed).uniform(0, 1, (4096, 3))
    given = planes(origins, np.zeros(4096, bool), seed)
    given[1][:, :3] = [0.9, 0.5, 0.1]
    octants = (origins[RayOrder(given, BOUNDS).rays] >= 0.5) @ [1, 2, 4]
    assert (octants[1:] != octants[:-1]).sum() == 7
