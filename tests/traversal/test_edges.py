"""Tests edge cases of a trace: interval ends, ties, invalid rays, degenerate scenes, step caps and
counters."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import assert_same_bits, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.methods import find_method

METHODS = [row.name for row in rt.methods()]
OF_NEIGHBOURS = {"ray-tiles"}  # methods that save work only if neighbouring rays are similar
pytestmark = pytest.mark.small
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]])


@pytest.mark.parametrize("method", METHODS)
def test_both_ends_of_the_interval_count(method: str) -> None:
    scene = rt.Scene.from_arrays(SQUARE, FACES)
    origins = np.tile(np.float32([0.5, 0.25, 2.0]), (5, 1))
    directions = np.tile(np.float32([0, 0, -1]), (5, 1))
    with rt.Tracer(scene, method) as tracer:
        above, below = (np.nextafter(np.float32(2), np.float32(end)) for end in (3, 1))
        hits = tracer.trace(origins, directions, t_min=[0, 2, above, 0, 0],
                            t_max=[np.inf, np.inf, np.inf, 2, below])
    assert hits.hit.tolist() == [True, True, False, True, False]
    assert hits.t[[0, 1, 3]].tolist() == [2, 2, 2]
    assert np.isinf(hits.t[[2, 4]]).all() and (hits.triangle[[2, 4]] == -1).all()


@pytest.mark.parametrize("method", METHODS)
def test_lowest_index_wins(method: str) -> None:
    faces = np.repeat(FACES, 40, axis=0)  # 40 copies of each triangle
    scene = rt.Scene.from_arrays(SQUARE, faces)
    points = np.random.default_rng(1).random((500, 2)).astype(np.float32)
    origins = np.column_stack([points, np.full(500, 3, np.float32)])
    with rt.Tracer(scene, method) as tracer:
        hits = tracer.trace(origins, np.tile(np.float32([0, 0, -1]), (500, 1)))
    below = points[:, 1] < points[:, 0]
    assert hits.triangle.tolist() == np.where(below, 0, 40).tolist()


@pytest.mark.parametrize("method", METHODS)
def test_barycentrics_give_the_hit_point(method: str) -> None:
    scene = soup_scene(200, 21)
    origins, directions = (np.random.default_rng(2).normal(size=(2000, 3)) for _ in range(2))
    origins = origins.astype(np.float32)
    directions = directions.astype(np.float32) * np.float32(7)  # directions need no unit length
    with rt.Tracer(scene, method) as tracer:
        hits = tracer.trace(origins, directions)
    at = hits.hit
    assert at.any()
    v0, v1, v2 = scene.triangles[hits.triangle[at]].astype(np.float64).transpose(1, 0, 2)
    u, v, t = (a[at, None].astype(np.float64) for a in (hits.u, hits.v, hits.t))
    ray_point = origins[at] + t * directions[at]
    np.testing.assert_allclose((1 - u - v) * v0 + u * v1 + v * v2, ray_point, atol=2e-4)


@pytest.mark.parametrize("scale", [2.0**-60, 2.0**-7, 2.0**9, 2.0**60])
@pytest.mark.parametrize("method", METHODS)
def test_direction_length_scales_t_alone(method: str, scale: float) -> None:
    scene = soup_scene(150, 3)
    origins, directions = np.random.default_rng(5).normal(size=(2, 600, 3)).astype(np.float32)
    with rt.Tracer(scene, method) as tracer:
        plain = tracer.trace(origins, directions)
        scaled = tracer.trace(origins, directions * np.float32(scale))
    assert (plain.triangle == scaled.triangle).all() and (plain.u == scaled.u).all()
    assert (plain.t[plain.hit] / np.float32(scale) == scaled.t[plain.hit]).all()


@pytest.mark.parametrize("method", METHODS)
def test_invalid_rays(method: str) -> None:
    scene = soup_scene(100, 4)
    origins, directions = np.random.default_rng(6).normal(size=(2, 300, 3)).astype(np.float32)
    with rt.Tracer(scene, method) as tracer:
        good = tracer.trace(origins, directions)
        directions[7] = 0
        origins[11, 1] = np.nan
        directions[290, 2] = np.inf
        with pytest.raises(ValueError, match="ray 7 "):
            tracer.trace(origins, directions)
        hits = tracer.trace(origins, directions, invalid="miss")
    bad = np.isin(np.arange(300), [7, 11, 290])
    assert (hits.status == bad).all()
    assert (hits.triangle[bad] == -1).all() and np.isinf(hits.t[bad]).all()
    for name in ("t", "u", "v", "triangle"):
        assert (getattr(hits, name)[~bad] == getattr(good, name)[~bad]).all()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("scene", ["empty", "point", "sliver", "one"])
def test_odd_scenes(method: str, scene: str) -> None:
    vertices = {"empty": np.zeros((0, 3)), "point": np.full((3, 3), 0.5),
                "sliver": [[0, 0, 0], [1, 1, 1], [2, 2, 2]], "one": SQUARE[:3]}[scene]
    made = rt.Scene.from_arrays(vertices, np.arange(len(vertices)).reshape(-1, 3))
    rng = np.random.default_rng(3)
    origins = rng.normal(size=(400, 3))
    directions = np.float32([0.5, 0.4, 0]) + 0.3 * rng.normal(size=(400, 3)) - origins
    with rt.Tracer(made, method) as tracer:
        hits = tracer.trace(origins, directions)
    oracle = rt.reference.trace(made, origins, directions)
    assert (hits.hit == oracle.hit).mean() > 0.997
    assert hits.hit.any() == (scene == "one")
    assert not hits.status.any()


@pytest.mark.parametrize("count", [0, 1, 1023, 1024, 1025])
def test_any_number_of_rays(count: int) -> None:
    scene = rt.Scene.from_arrays(SQUARE, FACES)
    origins = np.tile(np.float32([0.5, 0.25, 2.0]), (count, 1))
    with rt.Tracer(scene) as tracer:
        hits = tracer.trace(origins, np.tile(np.float32([0, 0, -1]), (count, 1)))
        assert len(hits) == count and hits.hit.all()
        assert len(tracer.occluded(origins, np.tile(np.float32([0, 0, -1]), (count, 1)))) == count


# Here, the quick suite runs only the last schedule. It runs the other schedules in
# tests/extremes/test_accelerators.py.
@pytest.mark.parametrize("method, schedule", [
    pytest.param(row.name, schedule, marks=() if schedule == row.schedules[-1]
                 else pytest.mark.full) for row in rt.methods() for schedule in row.schedules])
def test_step_cap_flags_rays(method: str, schedule: str) -> None:
    scene = soup_scene(200, 8)
    origins, directions = np.random.default_rng(8).normal(size=(2, 500, 3)).astype(np.float32)
    with rt.Tracer(scene, method, schedule=schedule, statistics=True) as tracer:
        whole = tracer.trace(origins, directions)
    cap = max(1, int(np.median(whole.steps)))
    with rt.Tracer(scene, method, schedule=schedule, step_cap=cap) as tracer:
        capped = tracer.trace(origins, directions)
    done = whole.steps < cap
    assert (capped.status[done] == 0).all()
    if find_method(method).single:  # a ray may end before its packet, whose steps are counted
        done = capped.status == 0
        assert not done.all()
    else:
        assert (capped.status[whole.steps > cap] == 2).all()
    assert (capped.triangle[done] == whole.triangle[done]).all()


@pytest.mark.parametrize("cap", [1, 2, 3, 10])
@pytest.mark.parametrize("options", [{}, {"octants": True}, {"interval_test": True},
                                     {"octants": True, "shared_subtrees": 16}], ids=str)
def test_packets_take_no_step_past_the_cap(options: dict, cap: int) -> None:
    scene = soup_scene(200, 8)
    rays = np.random.default_rng(8).normal(size=(2, 500, 3)).astype(np.float32)
    with rt.Tracer(scene, "bvh-packet", step_cap=cap, statistics=True, **options) as tracer:
        hits = tracer.trace(*rays)
    assert hits.steps.max() == cap and (hits.status == 2).any()


@pytest.mark.parametrize("method, schedule", [(row.name, schedule) for row in rt.methods()
                                              for schedule in row.schedules[:-1]])
def test_counters_do_not_depend_on_the_schedule(precise_renderer, method: str,
                                                schedule: str) -> None:
    scene = soup_scene(200, 14)
    origins, directions = np.random.default_rng(9).normal(size=(2, 500, 3)).astype(np.float32)
    # Under `loop`, a packet traces rays with different dominant axes one after another. Rays for
    # packet methods therefore share one dominant axis.
    if find_method(method).single:
        directions *= np.float32([1, 1, 1e4])
    counted = []
    for chosen in (find_method(method).schedules[-1], schedule):
        with rt.Tracer(scene, method, schedule=chosen, statistics=True) as tracer:
            counted.append(tracer.trace(origins, directions))
            means = tracer.statistics.counters
    for name in ("nodes_visited", "leaves_visited", "triangles_tested", "steps"):
        assert (getattr(counted[0], name) == getattr(counted[1], name)).all(), name
        assert means[name] == pytest.approx(getattr(counted[0], name).mean())
    assert counted[0].triangles_tested.max() > 0
    if method == "brute-force":
        assert (counted[0].triangles_tested == len(scene)).all()


def test_accelerators_save_tests() -> None:
    """According to its counters, each accelerator tests far fewer triangles than the scene
    holds."""
    scene = soup_scene(2000, 15, size=0.03)
    origins, directions = np.random.default_rng(9).random((2, 500, 3)).astype(np.float32)
    for name in METHODS[1:]:
        tiles = name in OF_NEIGHBOURS  # such a method needs the neighbouring rays of an image
        rays = scene.camera.rays((96, 96)) if tiles else (origins, directions)
        with rt.Tracer(scene, name, statistics=True) as tracer:
            hits = tracer.trace(*rays)
        assert hits.triangles_tested.mean() < 100, name
        assert (hits.leaves_visited <= hits.nodes_visited).all(), name


def test_loops_longer_than_the_renderer_allows() -> None:
    """llvmpipe ends a loop after 65,535 iterations without an error; the next pass continues the
    search."""
    count = 70_000
    corner = np.arange(count, dtype=np.float32)[:, None] * np.float32([0, 0, -1e-3])
    triangles = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0]]) + corner[:, None]
    faces = np.arange(3 * count).reshape(-1, 3)
    scene = rt.Scene.from_arrays(triangles.reshape(-1, 3), faces)
    with rt.Tracer(scene, "brute-force") as tracer:
        hits = tracer.trace([[0.2, 0.2, -100.0]], [[0, 0, 1]])
        assert tracer.statistics.passes > 1
    oracle = rt.reference.trace(scene, [[0.2, 0.2, -100.0]], [[0, 0, 1]])
    assert hits.triangle[0] == oracle.triangle[0] == count - 1
    assert not hits.status.any()


def test_shapes_agree(precise_renderer) -> None:
    scene = soup_scene(100, 30)
    origins, directions = scene.camera.rays((37, 21))
    with rt.Tracer(scene) as tracer:
        tile = tracer.trace(origins, directions)
        rows = tracer.trace(origins.reshape(-1, 3), directions.reshape(-1, 3))
        shaped = tracer.trace(origins.reshape(-1, 3), directions.reshape(-1, 3), shape=(21, 37))
        assert_same_bits(tile, rows)
        assert_same_bits(tile, shaped)
        for bad in ({"shape": (5, 5)}, {"t_min": np.zeros(3)}, {"invalid": "ignore"}):
            with pytest.raises(ValueError):
                tracer.trace(origins, directions, **bad)
        with pytest.raises(ValueError, match="differ"):
            tracer.trace(origins, directions[:5])
        with pytest.raises(ValueError, match=r"\(n, 3\)"):
            tracer.trace(np.zeros(3), np.ones(3))


@pytest.mark.parametrize("method", METHODS)
def test_counting_equals_statistics(method: str) -> None:
    """`counting` runs programs of its own on the built structure, and releases the programs
    afterwards."""
    scene = rt.load_scene("cornell")
    rays = scene.camera.rays((16, 16))
    with rt.Tracer(scene, method, statistics=True) as tracer:
        tracer.trace(*rays)  # this call builds the lists that a method makes on demand
        whole = tracer.trace(*rays)
        counters = tracer.statistics.counters
    with rt.Tracer(scene, method) as tracer:
        before = tracer.trace(*rays)
        tables, passes = dict(tracer.statistics.table_bytes), tracer.statistics.passes
        with tracer.counting():
            counted = tracer.trace(*rays)
            assert tracer.statistics.counters == counters and counters["nodes_visited"] >= 0
        after = tracer.trace(*rays)
        assert tracer.statistics.passes == passes and tracer.statistics.counters == {}
        assert tracer.statistics.table_bytes == tables
    assert before.steps is None and after.steps is None
    for name, values in whole.to_dict().items():
        assert np.array_equal(getattr(counted, name), values, equal_nan=True)
    assert np.array_equal(before.t, after.t) and np.array_equal(before.t, whole.t)


def test_counting_needs_a_single_method() -> None:
    pair = rt.Choices(rt.Choice("kd-packet", {}), rt.Choice("kd-restart", {}))
    with rt.Tracer("cornell", pair) as tracer:
        with pytest.raises(rt.OptionError, match="needs a tracer with a single method"):
            with tracer.counting():
                pass


@pytest.mark.parametrize("method", ["kd-restart", "bvh-packet"])
def test_update_is_refused_while_counting(method: str) -> None:
    scene = rt.load_scene("cornell")
    rays = scene.camera.rays((8, 8))
    with rt.Tracer(scene, method) as tracer:
        before = tracer.trace(*rays)
        with pytest.raises(rt.OptionError, match="counting"), tracer.counting():
            tracer.update(scene.triangles + np.float32(1))
        assert np.array_equal(tracer.trace(*rays).t, before.t) and tracer.scene is scene
        tracer.update(scene.triangles + np.float32(1))
        assert not np.array_equal(tracer.trace(*rays).t, before.t)


@pytest.mark.parametrize("method", ["kd-restart", "bvh-packet", "ray-engine"])
def test_a_tracer_that_was_released_says_so(method: str) -> None:
    scene = rt.load_scene("cornell")
    rays = scene.camera.rays((4, 4))
    with rt.Tracer(scene, method) as tracer:
        tracer.render(size=(8, 8))
    tracer.release()  # a second release does no harm
    for call in (lambda: tracer.trace(*rays), lambda: tracer.occluded(*rays),
                 lambda: tracer.trace_all(*rays), lambda: tracer.render(size=(8, 8)),
                 lambda: tracer.eye_hits(size=(8, 8)), lambda: tracer.plan(),
                 lambda: tracer.update(scene.triangles), lambda: tracer.counting().__enter__()):
        with pytest.raises(rt.Error, match="this tracer was released.*make another"):
            call()
    assert tracer.gpu.context.error == "GL_NO_ERROR"
    with rt.Tracer(scene, method) as another:
        assert another.trace(*rays).hit.any()
