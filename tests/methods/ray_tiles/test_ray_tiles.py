"""ray-tiles: a tile's cone rejects no triangle that one of the tile's rays hits."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import assert_same_bits, soup_scene

import gpgpu_rt as rt

SIDE = 8      # rays along a side of a tile (the default)


def tight_tiles(scene: rt.Scene, tiles: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return origins and directions, (SIDE, tiles * SIDE, 3), of rays that are hard to test.

    The rays of a tile start in a ball. They hit a triangle just inside the corner that lies on
    the triangle's bounding sphere. The rays are perpendicular to the line from the sphere's centre
    to the corner, so the tile's cone barely meets the sphere. Sizes and distances of balls vary.
    """
    rng = np.random.default_rng(seed)
    aim = scene.triangles[rng.integers(len(scene), size=tiles)].astype(np.float64)
    from_centre = aim - (aim.min(1) + aim.max(1))[:, None] / 2
    far = np.linalg.norm(from_centre, axis=2).argmax(1)
    spoke = from_centre[np.arange(tiles), far]
    size = np.linalg.norm(spoke, axis=1, keepdims=True)
    away = np.cross(spoke, rng.normal(size=(tiles, 3)))
    away *= size * 10 ** rng.uniform(-1, 2, (tiles, 1)) / np.linalg.norm(away, axis=1)[:, None]
    ball = size * 10 ** rng.uniform(-7, -1, (tiles, 1))
    shape = (tiles, SIDE * SIDE)
    inside = 10 ** rng.uniform(-6, -3, shape)[..., None] * rng.dirichlet((1, 1, 1), shape)
    weights = np.eye(3)[far][:, None] + inside
    aims = np.einsum("trk,tkx->trx", weights / weights.sum(2, keepdims=True), aim)
    origins = aims + away[:, None] + ball[:, None] * rng.normal(size=(*shape, 3))
    origins, directions = (a.reshape(tiles, SIDE, SIDE, 3).transpose(1, 0, 2, 3)
                           .reshape(SIDE, -1, 3).astype(np.float32)
                           for a in (origins, aims - origins))
    return origins, directions


def check(scene: rt.Scene, origins: np.ndarray, directions: np.ndarray, **ends: object) -> rt.Hits:
    """Check that `ray-tiles` gives the hits of brute force, and return these hits."""
    with rt.Tracer(scene, "brute-force") as tracer:
        expected = tracer.trace(origins, directions, **ends)
    with rt.Tracer(scene, "ray-tiles", statistics=True) as tracer:
        hits = tracer.trace(origins, directions, **ends)
    assert_same_bits(hits, expected)
    assert hits.hit.mean() > 0.05
    return hits


@pytest.mark.parametrize("seed", [1, 2], ids="seed{}".format)
def test_tight_cones_reject_no_hit(precise_renderer, seed: int) -> None:
    scene = soup_scene(150, seed, size=0.05)
    hits = check(scene, *tight_tiles(scene, 96, seed))
    assert hits.nodes_visited.mean() < 100     # the cones do reject triangles


def parallel_rays(z: float) -> tuple[np.ndarray, np.ndarray]:
    """Return (32, 32, 3) origins and directions of rays that go down from a square at height z."""
    x, y = np.meshgrid(np.linspace(0, 1, 32), np.linspace(0, 1, 32))
    origins = np.stack([x, y, np.full_like(x, z)], 2).astype(np.float32)
    return origins, np.broadcast_to(np.float32([0, 0, -1]), origins.shape)


@pytest.mark.parametrize("seed", [6], ids="seed{}".format)
def test_parallel_rays(precise_renderer, seed: int) -> None:
    """No hit of parallel rays is lost. The cone's angle is zero, so the cone's radius alone bounds
    the rays."""
    hits = check(soup_scene(200, seed, size=0.05), *parallel_rays(2.5))
    assert hits.nodes_visited.mean() < 50


@pytest.mark.parametrize("seed", [3], ids="seed{}".format)
def test_rays_that_go_backwards(precise_renderer, seed: int) -> None:
    """With t_min below zero, rays also hit triangles behind their origins."""
    scene = soup_scene(150, seed, size=0.05)
    origins, directions = tight_tiles(scene, 48, seed)
    hits = check(scene, origins, -directions, t_min=-np.inf)
    assert (hits.t[hits.hit] < 0).any()


@pytest.mark.parametrize("scale", [1e-8, 1e12], ids="scale{}".format)
def test_cones_of_any_size(precise_renderer, scale: float) -> None:
    """Very small and very large cones lose no hit."""
    scene = soup_scene(100, 4, size=0.05)
    scaled = rt.Scene.from_arrays((scene.triangles * np.float32(scale)).reshape(-1, 3),
                                  np.arange(300).reshape(-1, 3))
    origins, directions = tight_tiles(scene, 24, 4)
    check(scaled, origins * np.float32(scale), directions)


def test_a_hit_in_a_batch_ends_the_search(precise_renderer) -> None:
    """Triangle 0, a wall, hides all other triangles, so only the first 64 triangles are drawn."""
    wall = np.float32([[[-9, -9, 2], [9, -9, 2], [0, 14, 2]]])
    soup = soup_scene(1000, 5, size=0.02).triangles
    triangles = np.concatenate([wall, soup])
    scene = rt.Scene.from_arrays(triangles.reshape(-1, 3), np.arange(3003).reshape(-1, 3))
    hits = check(scene, *parallel_rays(2.5))
    assert (hits.triangle == 0).all() and hits.nodes_visited.max() <= 64


@pytest.mark.full
@pytest.mark.parametrize("kind", ["random", "tight"])
@pytest.mark.parametrize("seed", [11], ids="seed{}".format)
def test_a_million_rays(precise_renderer, kind: str, seed: int) -> None:
    scene = soup_scene(100, seed, size=0.1)
    if kind == "tight":
        for more in range(16):
            check(scene, *tight_tiles(scene, 1000, seed + more))
    else:
        rng = np.random.default_rng(seed)
        check(scene, rng.random((1000, 1000, 3)).astype(np.float32),
              rng.normal(size=(1000, 1000, 3)).astype(np.float32))
