"""Entry points: a beam bounds the rays of a tile of the image. These rays start their search at
the nodes that the beam enters, and so visit fewer nodes. In fp32, no hit is lost, whatever rays a
tile has."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import RAY_SETS, assert_same_bits, real_scene, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.traversal.records import ENTRIES

TILES = {row.name: sorted(option.choices) for row in rt.methods() for option in row.options
         if option.name == "entry_points"}
METHODS = list(TILES)
LISTS = [row.name for row in rt.methods() if row.name in TILES and not row.packet]
QUICK = ("bvh-threaded", "bvh-packet", "kd-restart")


def some(names: list[str]) -> list:
    return [pytest.param(name, marks=() if name in QUICK else pytest.mark.full)
            for name in names]


SOME = some(METHODS)
TWO_TILES = [(name, tile) for name in METHODS for tile in TILES[name][:2]]


def aimed_tiles(scene: rt.Scene, method: str, across: int, down: int, seed: int
                ) -> tuple[np.ndarray, np.ndarray]:
    """Return rays for down x across tiles: origins and directions, (side * down, side * across,
    3). ``side`` is the side of the method's smallest tiles.

    The rays of a tile begin at a point or in a ball of any size. They aim at vertices and edges,
    because boxes end there. In half of the tiles, all rays aim at the same triangle. In the other
    half, the rays aim at several neighbouring triangles.
    """
    rng = np.random.default_rng(seed)
    side = TILES[method][0]
    tiles, rays = down * across, side * side
    triangles = scene.triangles.astype(np.float64)
    centres = triangles.mean(1)
    one = rng.integers(len(scene), size=(tiles, 1))
    near = np.argsort(np.linalg.norm(centres[one] - centres, axis=2), axis=1)[:, :6]
    several = np.take_along_axis(near, rng.integers(6, size=(tiles, rays)), axis=1)
    chosen = np.where(rng.random((tiles, 1)) < 0.5, one, several)
    first = rng.integers(3, size=(tiles, rays))
    part = rng.random((tiles, rays, 1)) * (rng.random((tiles, 1, 1)) < 0.5)
    aims = ((1 - part) * triangles[chosen, first] + part * triangles[chosen, (first + 1) % 3])
    start = rng.normal(size=(tiles, 1, 3)) * 10 ** rng.uniform(-1, 1.5, (tiles, 1, 1)) + 0.5
    ball = 10 ** rng.uniform(-7, -1, (tiles, 1, 1)) * (rng.random((tiles, 1, 1)) < 0.7)
    origins = start + ball * rng.normal(size=(tiles, rays, 3))
    flat = rng.random((tiles, 1, 3)) < 0.15          # these components become -0
    directions = np.where(flat, np.float32(-0.0), aims - origins)
    origins = np.where(flat, aims, origins)
    return tuple(values.reshape(down, across, side, side, 3).transpose(0, 2, 1, 3, 4)
                 .reshape(down * side, across * side, 3).astype(np.float32)
                 for values in (origins, directions))


def check(scene: rt.Scene, origins: np.ndarray, directions: np.ndarray, method: str,
          ends: dict | None = None, tile: int = 16, **options: object) -> dict[str, float]:
    """Check that the hits equal the hits of the same method without entry points.

    Return the mean numbers of visited nodes per ray without and with entry points, the share of
    hits, and the driver's counters.
    """
    ends = {"invalid": "miss", **(ends or {})}
    with rt.Tracer(scene, method, statistics=True, **options) as tracer:
        plain = tracer.trace(origins, directions, **ends)
    with rt.Tracer(scene, method, statistics=True, entry_points=tile, **options) as tracer:
        for _ in range(2):     # the second call reuses the textures of the first
            hits = tracer.trace(origins, directions, **ends)
            assert_same_bits(hits, plain)
            assert (hits.status == plain.status).all()
        driver = tracer.statistics.driver
    return {"plain": plain.nodes_visited.mean(), "nodes": hits.nodes_visited.mean(),
            "hit": hits.hit.mean(), **driver}


@pytest.mark.parametrize("seed", [1, 2], ids="seed{}".format)
@pytest.mark.parametrize("method, tile", TWO_TILES, ids=str)
def test_beams_lose_no_aimed_ray(precise_renderer, method: str, seed: int, tile: int) -> None:
    found = check(soup_scene(200, seed, size=0.05), *aimed_tiles(
        soup_scene(200, seed, size=0.05), method, 24, 24, seed), method, tile=tile)
    assert found["hit"] > 0.3


@pytest.mark.parametrize("method", SOME)
def test_from_other_nodes(precise_renderer, method: str) -> None:
    """Entry points into octant copies, quantised nodes and trees of other builds lose no hit."""
    scene = soup_scene(100, 3, size=0.05)
    rays = aimed_tiles(scene, method, 12, 12, 3)
    settings: list[dict[str, object]] = [{"build": "hybrid"}]
    if method.startswith("bvh-"):
        settings += [{"octants": True}, {"octants": True, "quantise_nodes": 8},
                     {"octants": True, "shared_subtrees": 12}]
    if method == "bvh-packet":
        wide: dict[str, object] = {"packet": (4, 2), "interval_test": True}
        settings += [wide, {**wide, "octants": True}, {"quantise_nodes": 16, "packet": (4, 4)},
                     {**wide, "octants": True, "shared_subtrees": 12},
                     {"packet": (1, 1), "vertex_culling": True, "octants": True}]
    for options in settings:
        check(scene, *rays, method, **options)


@pytest.mark.parametrize("precision", ["fp24", "fp16"])
@pytest.mark.parametrize("method", SOME)
def test_in_low_precision(precise_renderer, method: str, precision: str) -> None:
    """In low precision, a BVH with entry points has at most one wrong hit. A kd-tree has wrong
    hits with and without entry points. Entry points add no wrong hits, because fewer rounded steps
    lead down from an entry point than from the root."""
    scene = soup_scene(100, 3, size=0.05)
    rays = aimed_tiles(scene, method, 12, 12, 3)
    wrong = []
    with rt.Tracer(scene, "brute-force", precision=precision) as tracer:
        truth = tracer.trace(*rays)
    for tile in (None, TILES[method][0]):
        with rt.Tracer(scene, method, precision=precision, entry_points=tile) as tracer:
            hits = tracer.trace(*rays)
        wrong.append(int(((hits.t != truth.t) | (hits.triangle != truth.triangle)).sum()))
    assert wrong[1] <= wrong[0]
    assert method.startswith("kd-") or wrong[1] <= 1


@pytest.mark.parametrize("method", METHODS)
def test_rays_of_all_kinds_in_one_tile(precise_renderer, method: str) -> None:
    """A tile holds eye rays, random rays, empty rays and invalid rays. No side of the image is a
    multiple of a tile's side."""
    scene = soup_scene(300, 4)
    eye, anywhere = (RAY_SETS[kind](scene, 1089, 4) for kind in ("eye", "random"))
    some = np.random.default_rng(4).random(1089) < 0.02
    origins, directions = (np.where(some[:, None], b, a)[:37 * 29].reshape(37, 29, 3).copy()
                           for a, b in zip(eye, anywhere))
    origins[5, 6], directions[30, 2] = np.nan, 0
    t_max = np.random.default_rng(5).choice([-1.0, 0.5, np.inf], 37 * 29)
    check(scene, origins, directions, method, {"t_max": t_max})
    check(scene, origins, directions, method, {"t_min": -np.inf})
    check(scene, origins, directions, method, sort_rays=True)


@pytest.mark.parametrize("method", METHODS)
def test_few_rays_that_begin_nearer(precise_renderer, method: str) -> None:
    """The t_min of most rays lies behind all first hits. A few rays of a tile begin at the common
    origin, so the beam must begin there too."""
    scene = soup_scene(2000, 9, size=0.1)
    rays = scene.camera.rays((64, 64))
    with rt.Tracer(scene, method) as tracer:
        first = tracer.trace(*rays)
    behind = np.where(first.hit, first.t * 1.01, 0)
    t_min = np.where(np.random.default_rng(9).random(len(behind)) < 0.05, 0, behind.max())
    check(scene, *rays, method, {"t_min": t_min})


@pytest.mark.parametrize("method", METHODS)
def test_rays_that_go_both_ways(precise_renderer, method: str) -> None:
    """For each axis in turn, the rays of a tile go both ways along the axis. A beam cannot bound
    such rays along the axis. A component of a direction is 0, or its magnitude is at least 1."""
    scene = soup_scene(200, 8, size=0.05)
    origins, directions = aimed_tiles(scene, method, 12, 12, 8)
    origins = (0.5 * origins + 0.25).astype(np.float32)
    directions = np.sign(directions) + 0.1 * directions / np.abs(directions).max()
    for axis in range(3):
        both = directions.copy()
        both[::2, :, axis] *= -1
        check(scene, origins, both, method)


@pytest.mark.parametrize("method", some(LISTS))
def test_full_lists(precise_renderer, method: str) -> None:
    """The beam of a narrow tile passes through 200 walls, and most rays begin between two walls.
    The beam enters more subtrees than a list holds."""
    walls = np.tile(np.float32([[-.1, -.1, 0], [.1, -.1, 0], [0, .15, 0]]), (200, 1, 1))
    walls[:, :, 2] += np.linspace(0, 1, 200)[:, None]
    scene = rt.Scene.from_arrays(walls.reshape(-1, 3), np.arange(600).reshape(-1, 3))
    eye = np.full((48, 48, 3), [0, 0, 3], np.float32)
    x, y = np.meshgrid(np.linspace(-0.005, 0.005, 48), np.linspace(-0.005, 0.005, 48))
    directions = np.stack([x, y, np.full_like(x, -1)], 2).astype(np.float32)
    t_min = np.random.default_rng(6).uniform(1.9, 3.1, 48 * 48)
    found = check(scene, eye, directions, method, {"t_min": t_min})
    assert found["entries"] > 0.5 * ENTRIES


@pytest.mark.parametrize("method", SOME)
def test_an_empty_scene_and_few_rays(method: str) -> None:
    nothing = rt.Scene.from_arrays(np.zeros((0, 3)), np.zeros((0, 3), int))
    with rt.Tracer(nothing, method, entry_points=16) as tracer:
        assert not tracer.trace(np.zeros((5, 3)), np.ones((5, 3))).hit.any()
    scene = soup_scene(50, 7)
    with rt.Tracer(scene, method, entry_points=16) as tracer, \
            rt.Tracer(scene, method) as plain:
        for count in (1, 3, 1030):
            rays = RAY_SETS["surface"](scene, count, count)
            assert (tracer.trace(*rays).t == plain.trace(*rays).t).all()
        moved = scene.triangles + np.float32(0.25)     # entry lists must follow moved boxes
        for each in (tracer, plain):
            each.update(moved)
        assert_same_bits(tracer.trace(*rays), plain.trace(*rays))
        assert (np.asarray(tracer.render(size=(45, 31)))
                == np.asarray(plain.render(size=(45, 31)))).all()


def fewest(method: str) -> dict[str, object]:
    """Return the options with which a method saves the most node visits by entry points."""
    return {"octants": True} if method == "bvh-packet" else {}


@pytest.mark.parametrize("method", METHODS)
def test_fewer_nodes_on_eye_rays(method: str) -> None:
    scene = rt.load_scene("cornell")
    found = check(scene, *scene.camera.rays((64, 64)), method, **fewest(method))
    assert found["plain"] > 1.5 * (found["nodes"] + found["entry_nodes_visited"])


@pytest.mark.full
@pytest.mark.parametrize("name", ["robots", "kitchen", "conference"])
@pytest.mark.parametrize("method", METHODS)
def test_fewer_nodes_on_real_scenes(method: str, name: str) -> None:
    """On real scenes, entry points divide the number of visited nodes by more than 1.5, even if
    the nodes visited by beams are counted, too."""
    scene = real_scene(name)
    found = check(scene, *scene.camera.rays((256, 256)), method, **fewest(method))
    assert found["plain"] > 1.5 * (found["nodes"] + found["entry_nodes_visited"])


@pytest.mark.full
@pytest.mark.parametrize("seed", [11, 12, 13, 14], ids="seed{}".format)
@pytest.mark.parametrize("method", METHODS)
def test_a_million_aimed_rays(precise_renderer, method: str, seed: int) -> None:
    scene = soup_scene(150, seed, size=0.1)
    check(scene, *aimed_tiles(scene, method, 128, 128, seed), method)
