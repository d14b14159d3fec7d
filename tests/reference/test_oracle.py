"""The oracle (the float64 reference) gives known answers for edges, ties, flat triangles,
intervals, rounding and batches."""
from __future__ import annotations

import itertools

import numpy as np
import pytest
from conftest import RAY_SETS, random_soup, soup_scene

from gpgpu_rt.reference import nearest, settle, trace, trace_exact, tree

WAYS = {"brute force": {"accelerated": False}, "tree": {"accelerated": True}}


def square(cells: int) -> np.ndarray:
    """Returns the square [0, cells]^2 in the plane z = 0 as triangles, (2 cells^2, 3, 3). All
    coordinates are whole numbers."""
    x, y = (axis.reshape(-1) for axis in np.meshgrid(np.arange(cells), np.arange(cells)))
    a, b, c, d = (np.stack((x + i, y + j, 0 * x), 1) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)))
    return np.stack((np.stack((a, b, c), 1), np.stack((a, c, d), 1)), 1).reshape(-1, 3, 3)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("axis, mirror", list(itertools.product(range(3), (1, -1))))
def test_edges_and_vertices_belong_to_the_triangle(way: str, axis: int, mirror: int) -> None:
    """Rays along an axis, in both directions, hit every vertex and the middle of every edge of a
    square that is cut into cells."""
    triangles = np.roll(square(4) * (1, mirror, 1), axis, axis=2)
    x, y = (points.reshape(-1) for points in np.meshgrid(np.arange(9) / 2, np.arange(9) / 2))
    for side in (1, -1):
        origins = np.roll(np.stack((x, mirror * y, 0 * x + 2 * side), 1), axis, axis=1)
        directions = np.roll(np.tile((0.0, 0.0, -4.0 * side), (len(x), 1)), axis, axis=1)
        hits = trace(triangles, origins, directions, **WAYS[way])
        exact = trace_exact(triangles, origins, directions)
        assert (hits.t == 0.5).all() and (exact.t == 0.5).all()
        assert (hits.triangle == exact.triangle).all()
        v0, v1, v2 = triangles[hits.triangle].transpose(1, 0, 2)
        u, v = hits.u[:, None], hits.v[:, None]
        assert ((1 - u - v) * v0 + u * v1 + v * v2 == origins + 0.5 * directions).all()
        # The interval includes both of its ends, even if the ends are equal.
        t_end = trace(triangles, origins, directions, 0.5, 0.5, **WAYS[way])
        assert (t_end.triangle == hits.triangle).all()


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("seed", [1, 2])
def test_collinear_triangles_are_never_hit(way: str, seed: int) -> None:
    """Rays never hit a triangle with exactly collinear corners, in spite of rounding in the
    triangle test."""
    rng = np.random.default_rng(seed)
    start, step = rng.integers(-9, 9, (2, 2000, 1, 3)) / 8
    triangles = start + step * np.array((0, 2, 1))[:, None]
    target = start[:, 0] + step[:, 0] * rng.random((2000, 1))
    origins = rng.normal(size=(2000, 3)) * 3
    hits = trace(triangles, origins, target - origins, **WAYS[way])
    assert not hits.hit.any()


@pytest.mark.parametrize("seed", [3, 4])
def test_answers_do_not_depend_on_batches(seed: int, monkeypatch) -> None:
    """Batches of any size give the same hits. Each triangle occurs three times, in random order,
    and the lowest index wins even if the copies are in different batches."""
    rng = np.random.default_rng(seed)
    soup = np.tile(random_soup(60, seed, 0.5), (3, 1, 1))[rng.permutation(180)]
    origins, directions = rng.random((50, 3)), rng.normal(size=(50, 3))
    plain = trace(soup, origins, directions)
    first = np.array([np.flatnonzero((soup == soup[i]).all(axis=(1, 2)))[0] for i in range(180)])
    assert plain.hit.sum() > 20
    assert (first[plain.triangle[plain.hit]] == plain.triangle[plain.hit]).all()
    exact = trace_exact(soup, origins, directions)
    assert (exact.triangle == plain.triangle).all()
    monkeypatch.setattr(nearest, "_PAIRS", 37)
    monkeypatch.setattr(tree, "_PAIRS", 11)
    for way in WAYS.values():
        again = trace(soup, origins, directions, **way)
        for name in ("t", "u", "v", "triangle"):
            assert (getattr(again, name) == getattr(plain, name)).all()


def test_vertices_and_rays_are_rounded_on_entry() -> None:
    triangles = np.array([[[0.1, 0.1, 0.1], [1.1, 0.1, 0.3], [0.1, 1.1, 0.7]]])
    origins, directions = np.array([[0.3, 0.3, 3.3]]), np.array([[0.01, 0.02, -1.1]])
    given = trace(triangles, origins, directions, t_max=1e300)
    rounded = trace(*(np.float32(a) for a in (triangles, origins, directions)))
    assert given.hit.all() and given.t == rounded.t and given.u == rounded.u


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("exponent", [-60, -20, 20, 60])
def test_scale_changes_nothing(way: str, exponent: int) -> None:
    """Scaling a scene by a power of two scales t exactly."""
    rng = np.random.default_rng(5)
    soup, origins = random_soup(200, 5, 0.4).astype(np.float32), np.float32(rng.random((300, 3)))
    directions = np.float32(rng.normal(size=(300, 3)))
    scale = np.float32(2.0) ** exponent
    plain = trace(soup, origins, directions)
    scaled = trace(soup * scale, origins * scale, directions, **WAYS[way])
    assert (plain.triangle == scaled.triangle).all() and (plain.t * scale == scaled.t).all()


@pytest.mark.parametrize("bad", [
    dict(origins=np.zeros((2, 2))), dict(directions=np.ones((3, 3))), dict(invalid="ignore"),
    dict(scene_or_triangles=np.zeros((4, 3))), dict(directions=np.zeros((2, 3))),
    dict(scene_or_triangles=np.full((1, 3, 3), np.nan)),
    dict(scene_or_triangles=np.full((1, 3, 3), 1e39)),
    dict(directions=np.full((2, 3), np.inf)), dict(t_max=np.nan)])
def test_bad_arguments(bad: dict) -> None:
    """Arguments of wrong shapes or values raise ValueError."""
    good = dict(scene_or_triangles=square(1), origins=np.zeros((2, 3)), directions=np.ones((2, 3)))
    with pytest.raises(ValueError):
        trace(**{**good, **bad})


@pytest.mark.parametrize("seed", [7])
def test_a_speck_far_from_the_ray_is_not_hit(seed: int) -> None:
    """The triangle is tiny compared with the origin's coordinates, so its edge functions consist
    only of rounding errors. A ray far from the triangle still misses the triangle."""
    rng = np.random.default_rng(seed)
    specks = (10 ** rng.uniform(-17, -15, (400, 1, 1)) * rng.normal(size=(400, 3, 3)))
    # The rays pass the specks at a great distance.
    origins, directions = rng.normal(size=(2, 400, 3))
    for way in WAYS.values():
        assert not trace(specks, origins, directions, **way).hit.any()


@pytest.mark.parametrize("seed", [8, 9])
def test_settle_agrees_with_rationals(seed: int) -> None:
    """`settle` corrects float64 hits to the hits of exact rational arithmetic. Half of the
    rays aim at vertices, which have whole coordinates, and the other rays aim near vertices. Many
    rays meet several triangles at the same t."""
    rng = np.random.default_rng(seed)
    triangles = np.concatenate((square(4), square(4)[:, ::-1], square(2) * (2, 2, 1)))
    triangles = triangles @ np.array(((1, 0, 1), (0, 1, -1), (0, 0, 1)))  # tilted
    aims = triangles[rng.integers(len(triangles), size=300), rng.integers(3, size=300)]
    aims = aims + rng.integers(0, 2, (300, 1)) * rng.integers(-1, 2, (300, 3)) / 3
    origins = (rng.normal(size=(300, 3)) * 9).astype(np.float32)
    directions = (aims - origins).astype(np.float32)
    exact = trace_exact(triangles, origins, directions)
    float64 = trace(triangles, origins, directions)
    settled, doubtful = settle(triangles, origins, directions, float64)
    assert (settled.triangle == exact.triangle).all() and 50 < doubtful <= 300
    np.testing.assert_allclose(settled.t, exact.t, rtol=1e-12)
    # Without `settle`, the rounding of float64 decides between triangles at the same t.
    assert (float64.triangle != exact.triangle).any()
    again, _ = settle(triangles, origins, directions, settled)
    assert (again.triangle == exact.triangle).all() and (again.t == settled.t).all()


@pytest.mark.parametrize("seed", [10])
def test_settle_leaves_sure_rays_alone(seed: int) -> None:
    rng = np.random.default_rng(seed)
    # Copies of a triangle do not make a ray doubtful, because the lowest index wins.
    soup = np.tile(random_soup(80, seed, 0.5), (2, 1, 1))
    origins, directions = rng.random((500, 3)), rng.normal(size=(500, 3))
    directions[7] = 0
    hits = trace(soup, origins, directions, invalid="miss")
    settled, doubtful = settle(soup, origins, directions, hits)
    assert doubtful == 0
    for name in ("t", "u", "v", "triangle", "status"):
        assert (getattr(settled, name) == getattr(hits, name)).all()
    # A ray whose hit lies exactly at an end of the interval counts as doubtful. `settle` then
    # decides that the hit is inside the interval.
    flat = np.float32([[[0, 0, 0], [3, 0, 0], [0, 3, 0]]])
    ray = np.float32([[1, 1, 2]]), np.float32([[0, 0, -1]])
    hits = trace(flat, *ray, 0, 2)
    settled, doubtful = settle(flat, *ray, hits, 0, 2)
    assert doubtful == 1 and settled.triangle[0] == 0 and settled.t[0] == 2


@pytest.mark.parametrize("seed", [11])
@pytest.mark.parametrize("rays", RAY_SETS)
def test_pruning_loses_no_hit(rays: str, seed: int, monkeypatch) -> None:
    """A ray's nearest hit so far and the ends of its interval prune the search in the tree, but
    the hits equal those of brute force. Batches are small, so hits of earlier batches prune later
    batches."""
    scene = soup_scene(500, seed, 0.1)
    origins, directions = RAY_SETS[rays](scene, 400, seed)
    ends = np.random.default_rng(seed).uniform(0.1, 2, (2, 400))
    monkeypatch.setattr(tree, "_PAIRS", 64)
    for t_min, t_max in ((0, np.inf), (0, ends[0]), (ends[0], ends[0] + ends[1]), (-1, 1)):
        plain = trace(scene, origins, directions, t_min, t_max)
        fast = trace(scene, origins, directions, t_min, t_max, accelerated=True)
        for name in ("t", "u", "v", "triangle"):
            assert (getattr(plain, name) == getattr(fast, name)).all()
