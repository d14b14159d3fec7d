"""ray-hierarchy: each cone contains its rays and rejects no triangle that one of the rays hits,
for images and streams of any size."""
from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from conftest import RAY_SETS, assert_same_bits, random_soup, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.gl.textures import read_texture
from gpgpu_rt.methods.ray_hierarchy.cones import level_sizes
from gpgpu_rt.methods.ray_hierarchy.records import CONE

# The triangle is so large that no ray starts far outside the scene. The tracer would move the
# origin of such a ray to a point near the scene.
LARGE = np.float32([[[-50, -50, -50], [50, 50, -50], [50, -50, 50]]])


def scene_of(triangles: np.ndarray) -> rt.Scene:
    return rt.Scene.from_arrays(triangles.reshape(-1, 3),
                                np.arange(3 * len(triangles)).reshape(-1, 3), name="soup")


def narrow(rng: np.random.Generator, shape: tuple[int, int], spread: float) -> np.ndarray:
    """Return (h, w, 3) directions around an oblique direction; the spread grows with the row."""
    off = rng.normal(size=(*shape, 3)) * spread * np.linspace(0, 1, shape[0])[:, None, None]
    return np.float64([0.48, -0.64, 0.6]) + off


RAYS: dict[str, Callable] = {
    "parallel": lambda rng, s: (rng.random((*s, 3)), narrow(rng, s, 0)),
    "one origin": lambda rng, s: (np.full((*s, 3), 0.3), narrow(rng, s, 0.2)),
    "nearly parallel": lambda rng, s: (rng.random((*s, 3)) * 1e-3, narrow(rng, s, 1e-6)),
    "far away": lambda rng, s: (rng.random((*s, 3)) + 30, narrow(rng, s, 1e-3)),
    "all ways": lambda rng, s: (rng.random((*s, 3)), rng.normal(size=(*s, 3))),
    "there and back": lambda rng, s: (rng.random((*s, 3)), narrow(rng, s, 0)
                                      * rng.choice([-1.0, 1.0], (*s, 1))),
}


def cones_over(origins: np.ndarray, directions: np.ndarray, **intervals: np.ndarray) -> tuple:
    """Return three values: a dict of node fields for each level, the fan-out of each level, and
    the hierarchy's unit of length."""
    with rt.Tracer(scene_of(LARGE), "ray-hierarchy") as tracer, tracer.gpu:
        tracer.trace(origins, directions, **intervals)
        cones = tracer.session.driver.cones
        levels = []
        for level in cones.levels:
            texels = np.stack([read_texture(t).reshape(-1, 4) for t in level.textures], 1)
            levels.append({name: value.reshape(level.size[1], level.size[0], -1).astype(float)
                           for name, value in CONE.unpack(texels).items()})
        return levels, cones.fans, tracer.session.driver.unit


@pytest.mark.parametrize("seed", [1, 2], ids="seed{}".format)
@pytest.mark.parametrize("shape", [(1, 1), (1, 700), (61, 1), (37, 53), (64, 64)])
@pytest.mark.parametrize("kind", RAYS)
def test_a_node_bounds_all_rays_below(kind: str, shape: tuple[int, int], seed: int) -> None:
    """Each node bounds its rays' origins, directions and ends, checked in float64."""
    rng = np.random.default_rng(seed)
    origins, directions = (a.astype(np.float32) for a in RAYS[kind](rng, shape))
    ends = np.float32(2) + rng.random(shape).astype(np.float32)
    over = rng.random(shape) < 0.2
    ends[over] = -1
    levels, fans, unit = cones_over(origins, directions, t_max=ends.reshape(-1))
    row, column = np.indices(shape)
    length = np.linalg.norm(directions.astype(float), axis=2)
    for k, level in enumerate(levels):
        node = {name: value[row, column] for name, value in level.items()}
        assert (node["reach"][..., 0][~over] >= (ends * length * unit)[~over]).all(), k
        off = np.linalg.norm(origins.astype(float) * unit - node["centre"], axis=2)
        assert (off <= node["radius"][..., 0])[~over].all(), k
        turn = np.linalg.norm(directions / length[..., None] - node["axis"], axis=2)
        assert (turn <= node["chord"][..., 0])[~over].all(), k
        assert k or (node["reach"][..., 0][over] == -1).all()
        if k < len(fans):
            column, row = column // fans[k][0], row // fans[k][1]
    assert levels[-1]["reach"].shape == (1, 1, 1)


@pytest.mark.parametrize("size", [(1, 1), (1, 5), (5, 1), (2, 2), (600, 1), (1024, 4), (33, 70)])
def test_four_nodes_become_one(size: tuple[int, int]) -> None:
    sizes, fans = level_sizes(size)
    assert sizes[0] == size and sizes[-1] == (1, 1) and len(sizes) == len(fans) + 1 >= 2
    assert all(x * y == 4 for x, y in fans)
    for below, above, fan in zip(sizes, sizes[1:], fans):
        assert above == tuple(-(-n // f) for n, f in zip(below, fan))


@pytest.mark.parametrize("seed", [5], ids="seed{}".format)
@pytest.mark.parametrize("place", [0.0, 1e3])
@pytest.mark.parametrize("side", [64, pytest.param(1000, marks=pytest.mark.full)])
def test_no_triangle_is_rejected_that_a_ray_hits(precise_renderer, side: int, place: float,
                                                 seed: int) -> None:
    """Hits equal those of brute force to the bit, in scenes near the origin and far away.

    Half of the rays aim at corners and edges, and the full suite traces a million rays. No node
    above a ray may reject the triangle that the ray hits.
    """
    rng = np.random.default_rng(seed)
    triangles = (random_soup(60, seed) + place).astype(np.float32)
    triangles[::3] = triangles[::3, :1] + 1e-3 * (triangles[::3] - triangles[::3, :1])
    scene = scene_of(triangles)
    sets = [RAY_SETS[kind](scene, side * side // 4, seed)
            for kind in ("random", "vertices", "edges", "surface")]
    origins, directions = (np.concatenate(parts) for parts in zip(*sets))
    # Sort the rays by direction and then by origin, so that tiles have narrow cones.
    order = np.lexsort([rng.random(len(origins)), np.floor(8 * (origins[:, 0] - place)),
                        np.floor(4 * directions[:, 1])])
    rays = origins[order], directions[order]
    answers = []
    for method in ("ray-hierarchy", "brute-force"):
        with rt.Tracer(scene, method) as tracer:
            answers.append(tracer.trace(*rays, shape=(side, len(order) // side)))
    assert answers[1].hit.mean() > 0.4 and not answers[0].status.any()
    assert_same_bits(*answers)


@pytest.mark.parametrize("seed", [8, *(pytest.param(seed, marks=pytest.mark.full)
                                       for seed in range(9, 19))], ids="seed{}".format)
def test_rays_along_a_ball_are_not_rejected(precise_renderer, seed: int) -> None:
    """Rays that pass just inside a corner of a small triangle keep their hits.

    The rays are perpendicular to the line from the centre of the triangle's bounding ball to the
    corner. Without a margin in the cone test, one hit in 40 would be lost.
    """
    rng, count = np.random.default_rng(seed), 4096
    side, other = rng.normal(size=(2, 40, 3)) * 3e-3
    other -= side * ((side * other).sum(1) / (side * side).sum(1))[:, None]
    corner = rng.random((40, 3))
    triangles = np.stack([corner, corner + side, corner + other], 1).astype(np.float32)
    pick = rng.integers(40, size=count)
    exact = triangles[pick].astype(float)
    radius = (exact[:, 1] - exact[:, 2]) / 2     # half of the longest side of a right triangle
    way = rng.normal(size=(count, 3))
    way -= radius * ((radius * way).sum(1) / (radius * radius).sum(1))[:, None]
    inside = 10 ** rng.uniform(-6, -3, (count, 1)) * (exact.mean(axis=1) - exact[:, 1])
    rays = exact[:, 1] + inside - 2 * way / np.linalg.norm(way, axis=1)[:, None], way
    answers = []
    for method in ("ray-hierarchy", "brute-force"):
        with rt.Tracer(scene_of(triangles), method) as tracer:
            answers.append(tracer.trace(*rays, shape=(64, 64)))
    assert answers[1].hit.mean() > 0.3
    assert_same_bits(*answers)


@pytest.mark.parametrize("seed", [3], ids="seed{}".format)
@pytest.mark.parametrize("options", [{"stream_size": 1}, {"stream_size": 37},
                                     {"stream_size": 250, "top_nodes": 1},
                                     {"first_batch": 1, "top_nodes": 1000}], ids=str)
def test_a_stream_never_overflows(precise_renderer, options: dict, seed: int) -> None:
    """Incoherent rays have far more (triangle, cone) pairs than a stream has space for."""
    scene = soup_scene(40, seed)
    rays = RAY_SETS["random"](scene, 40, seed)
    answers = []
    for more in ({}, options):
        with rt.Tracer(scene, "ray-hierarchy", statistics=True, **more) as tracer:
            answers.append(tracer.trace(*rays))
            room, size = tracer.session.driver, tracer.options["stream_size"]
            assert room.bytes() > 0
            assert all(pairs.length <= max(1024, 8 * size) for pairs in room._pairs.values())
    assert_same_bits(*answers)
    assert (answers[0].triangles_tested > 0).any()
    if "top_nodes" not in options:
        for name in ("nodes_visited", "triangles_tested", "steps"):
            assert (getattr(answers[0], name) == getattr(answers[1], name)).all(), name


@pytest.mark.parametrize("seed", [4], ids="seed{}".format)
def test_intervals_of_all_kinds(precise_renderer, seed: int) -> None:
    """Hits equal those of brute force if intervals begin behind the origin, are short or are
    empty."""
    scene, rng = soup_scene(200, seed), np.random.default_rng(seed)
    origins, directions = RAY_SETS["random"](scene, 900, seed)
    t_min = rng.choice([-np.inf, -2.0, -0.1, 0.0, 0.1], 900)
    t_max = rng.choice([np.inf, 1.0, 0.1, -0.05, 0.0], 900)
    answers = []
    for method in ("ray-hierarchy", "brute-force"):
        with rt.Tracer(scene, method) as tracer:
            answers.append(tracer.trace(origins, directions, t_min, t_max, shape=(30, 30)))
    assert (answers[1].t[answers[1].hit] < 0).any()
    assert_same_bits(*answers)


@pytest.mark.parametrize("seed", [6], ids="seed{}".format)
def test_visits_are_the_pairs_above_a_ray(seed: int) -> None:
    """A ray's count of visited nodes is the number of tested (triangle, cone) pairs whose cone
    contains the ray. This test counts the pairs each time the driver tests a level."""
    scene = soup_scene(150, seed)
    origins, directions = RAY_SETS["eye"](scene, 900, seed)
    with rt.Tracer(scene, "ray-hierarchy", statistics=True) as tracer:
        driver = tracer.session.driver
        expected = np.zeros((30, 30), int)

        def test_and_count(level: int, first: int, count: int) -> int:
            pairs = driver._pairs[level].read(first + count)
            at = np.indices((30, 30))
            for fan in driver.cones.fans[:level]:
                at = at[0] // fan[1], at[1] // fan[0]
            visits = np.zeros(driver.cones.levels[level].size[::-1], int)
            np.add.at(visits, (pairs["y"][first:], pairs["x"][first:]), 1)
            expected[...] += visits[at[0], at[1]]
            return test(level, first, count)
        test, driver._test = driver._test, test_and_count
        hits = tracer.trace(origins, directions, shape=(30, 30))
    assert (hits.nodes_visited.reshape(30, 30) == expected).all() and expected.min() >= 150
    assert (hits.steps == hits.triangles_tested).all()
    assert (hits.leaves_visited == hits.triangles_tested).all()


@pytest.mark.parametrize("seed", [7], ids="seed{}".format)
def test_nothing_is_built_over_triangles(seed: int) -> None:
    """The method has no structure over triangles, so an update rebuilds nothing."""
    triangles = random_soup(200, seed)
    with rt.Tracer(scene_of(triangles), "ray-hierarchy") as tracer:
        assert tracer.accelerator.structure is None and set(tracer.session.tables) == {"triangle"}
        first = np.asarray(tracer.render(size=(24, 24)))
        tracer.update(triangles + np.float32([0.3, 0, 0]))
        assert not tracer.statistics.rebuilt
        assert (np.asarray(tracer.render(size=(24, 24))) != first).any()
