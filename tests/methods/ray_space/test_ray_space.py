"""`ray-classification` and `visibility-field` keep lists of triangles for sets of rays. The list
of a ray holds every triangle that the ray hits, and memory stays within the budget."""
from __future__ import annotations

from contextlib import nullcontext

import numpy as np
import pytest
from conftest import assert_same_bits, random_soup, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.accel.bounds import shrink_flat
from gpgpu_rt.gl.record import EXACT_INTEGER
from gpgpu_rt.inspect.observe import observe_states
from gpgpu_rt.methods.ray_space.ray_boxes import RayBoxes
from gpgpu_rt.methods.ray_space.visibility_field import build_visibility_field
from gpgpu_rt.numerics.watertight import intersect_pairs

METHODS = ("ray-classification", "visibility-field")
MIB = 1 << 20
AT_ONCE = 1 << 20       # pairs of ray and triangle that are tested in one block


def rays_everywhere(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return n origins in and around the unit box, and n directions of all kinds.

    If a ray starts far from the scene, the tracer moves its origin along the ray to a nearer
    point. The farthest origins here are about as far as a ray can start without such a move. A
    third of the directions have components of equal size or components that are zero.
    """
    rng = np.random.default_rng(seed)
    origins = 0.5 + rng.choice([0.4, 0.8, 1.6], (n, 1)) * rng.uniform(-1, 1, (n, 3))
    directions = rng.normal(size=(n, 3))
    directions[::3] = rng.choice([-1.0, 0.0, 1.0], (len(directions[::3]), 3))
    directions[(directions == 0).all(axis=1)] = 1
    return origins.astype(np.float32), directions.astype(np.float32)


def crossed_soup(count: int, seed: int) -> rt.Scene:
    """Return a scene in which half of the triangles are tiny and lie in the scene's middle planes.

    In `visibility-field`, a beam is a set of rays that read the same list and cross the same tile
    of a middle plane. A beam is narrowest at this plane. If its bounds were too narrow, its list
    would lose the triangles there first.
    """
    triangles = random_soup(count, seed, 0.08)
    tiny = triangles[::2]
    tiny[:] = tiny[:, :1] + 0.05 * (tiny - tiny[:, :1])
    for axis in range(3):
        tiny[axis::3, :, axis] = np.mean([triangles[..., axis].min(), triangles[..., axis].max()])
    return rt.Scene.from_arrays(triangles.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


def listed(tracer: rt.Tracer) -> tuple[np.ndarray, np.ndarray]:
    """Return two arrays. The first, (lists + 1, triangles) bool, says which triangles each list
    holds. The second, (n,), gives the index of the list of each ray of the last call. A ray
    without a list has the last index, ``lists``."""
    structure = tracer.accelerator.structure
    triangle = structure.triangle
    if isinstance(structure, RayBoxes):
        with tracer.gpu:
            box = tracer.session.driver._box_of_each(
                tracer.session.buffers.rays, tracer.statistics)
        owner = np.cumsum(triangle == -1) - (triangle == -1)
        lists = owner[-1] + 1
        number = np.where(box >= 0, owner[structure.directory[box]], lists)
    else:
        state = tracer.session.buffers.states.side(0).fields("state")
        lists = len(structure.beam_start) - 1
        owner = np.repeat(np.arange(lists), np.diff(structure.beam_start))
        number = np.searchsorted(structure.beam_start, state["first"], side="right") - 1
        number[state["first"] == state["end"]] = lists
    table = np.zeros((lists + 1, len(tracer.scene)), bool)      # the last row is empty
    table[owner[triangle >= 0], triangle[triangle >= 0]] = True
    return table, number


def false_rejections(method: str, rays: int, triangles: int, seed: int, **options) -> int:
    """Count the ray-triangle pairs that the watertight test accepts but the ray's list lacks."""
    scene = crossed_soup(triangles, seed)
    origins, directions = rays_everywhere(rays, seed)
    rng = np.random.default_rng(seed)
    aims = scene.triangles[rng.integers(triangles, size=rays // 2), rng.integers(3)]
    directions[::2] = aims[:len(directions[::2])] - origins[::2]
    with rt.Tracer(scene, method, **options) as tracer:
        # Under the schedule `loop`, states are stored only if a function observes them.
        watched = (observe_states(tracer, lambda one: None)
                   if getattr(tracer.session.driver, "keeps_states", False) else nullcontext())
        with watched:
            tracer.trace(origins, directions)
        table, number = listed(tracer)
    missing = met = 0
    # Tracers store triangles of zero area as points, which no ray hits.
    stored = shrink_flat(scene.triangles)
    step = AT_ONCE // triangles
    for start in range(0, rays, step):
        part = slice(start, min(start + step, rays))
        count = part.stop - start
        every = np.tile(np.arange(triangles), count)
        accepted, t, _, _ = intersect_pairs(stored[every],
                                            np.repeat(origins[part], triangles, axis=0),
                                            np.repeat(directions[part], triangles, axis=0))
        met_now = accepted & (t >= 0)
        met += int(met_now.sum())
        held = table[np.repeat(number[part], triangles), every]
        missing += int((met_now & ~held).sum())
    assert met > rays / 40
    return missing


@pytest.mark.parametrize("seed", [51], ids="seed{}".format)
@pytest.mark.parametrize("method, options", [
    ("ray-classification", {}), ("visibility-field", {}),
    ("visibility-field", {"directions": 3, "tiles": 50})])
def test_no_list_misses_a_triangle(method: str, options: dict, seed: int) -> None:
    assert false_rejections(method, 8000, 150, seed, **options) == 0


@pytest.mark.full
@pytest.mark.parametrize("seed", [52, 53], ids="seed{}".format)
@pytest.mark.parametrize("method, options", [
    ("ray-classification", {"origin_cells": 4, "direction_cells": 8, "budget": 200.0}),
    ("ray-classification", {}), ("visibility-field", {}),
    ("visibility-field", {"directions": 3, "tiles": 50})])
def test_no_list_misses_a_triangle_of_a_million_rays(method: str, options: dict, seed: int
                                                     ) -> None:
    assert false_rejections(method, 1_000_000, 60, seed, **options) == 0


@pytest.mark.parametrize("method, budgets", [("ray-classification", (3.05, 3.2, 8.0)),
                                             ("visibility-field", (0.05, 0.2, 4.0))])
def test_a_budget_coarsens_and_changes_no_hit(precise_renderer, method: str,
                                              budgets: tuple) -> None:
    """A smaller budget gives coarser lists: rays test more triangles, but find the same hits."""
    scene = soup_scene(300, 54, 0.1)
    chosen = rays_everywhere(1500, 54)
    with rt.Tracer(scene, "brute-force") as tracer:
        expected = tracer.trace(*chosen)
    tested, held = [], []
    for budget in budgets:
        with rt.Tracer(scene, method, budget=budget, statistics=True) as tracer:
            assert_same_bits(tracer.trace(*chosen), expected)
            tested.append(tracer.statistics.counters["triangles_tested"])
            structure = tracer.accelerator.structure
            held.append(16 * len(structure.triangle) + 8 * len(structure.beam_start)
                        if method == "visibility-field"
                        else 8 * structure.used + 4 * len(structure.directory))
    assert tested[0] > tested[1] > tested[2]
    assert all(size <= budget * MIB for size, budget in zip(held, budgets))


@pytest.mark.parametrize("method, budget", [("ray-classification", 3.0),
                                            ("visibility-field", 0.001)])
def test_a_budget_that_nothing_fits_is_refused(method: str, budget: float) -> None:
    with pytest.raises(rt.LimitError, match="raise budget"):
        rt.Tracer(soup_scene(300, 1), method, budget=budget)


def test_boxes_that_cannot_be_counted_are_refused() -> None:
    scene = soup_scene(10, 1)
    with pytest.raises(rt.OptionError, match="power of two"):
        rt.Tracer(scene, "ray-classification", origin_cells=6)
    with pytest.raises(rt.LimitError, match="2\\^24"):
        rt.Tracer(scene, "ray-classification", origin_cells=64)


def test_lists_are_filled_and_dropped(precise_renderer) -> None:
    """A call fills the lists that its rays need. If the budget is exceeded, the call
    drops older lists."""
    scene = soup_scene(200, 55, 0.1)
    calls = []
    for seed in (55, 56, 57, 58):       # all rays of a call start at one point
        origins, directions = rays_everywhere(800, seed)
        calls.append((np.tile(origins[:1] / 2, (800, 1)), directions))
    used = []
    with rt.Tracer(scene, "brute-force") as plain, rt.Tracer(
            scene, "ray-classification", budget=3.15) as tracer:
        boxes = tracer.accelerator.structure
        for chosen in (calls[0], calls[0], *calls[1:]):
            assert_same_bits(tracer.trace(*chosen), plain.trace(*chosen))
            used.append(boxes.used)
            assert used[-1] <= boxes.most
            assert tracer.statistics.driver["candidates"] == boxes.used
        assert 6 * 201 < used[0] == used[1]
        assert any(later < before for before, later in zip(used, used[1:]))
        tracer.update(scene.triangles[:, [1, 2, 0]] + np.float32(0.25))
        plain.update(scene.triangles[:, [1, 2, 0]] + np.float32(0.25))
        assert_same_bits(tracer.trace(*calls[0]), plain.trace(*calls[0]))


@pytest.mark.parametrize("method", METHODS)
def test_a_camera_from_afar(precise_renderer, method: str) -> None:
    """Eye rays made on the GPU start at the far camera and read a list of all triangles."""
    scene = soup_scene(60, 59)
    centre = np.mean(scene.bounds, axis=0)
    camera = rt.Camera(centre + np.float32([40, 60, 50]), centre, fov=1.5)
    pictures, afar = [], 0.0
    for name in ("brute-force", method):
        with rt.Tracer(scene, name) as tracer:
            pictures.append(np.asarray(tracer.render(camera, (40, 40))))
            hits = tracer.trace(*camera.rays((40, 40)))
            afar = tracer.statistics.driver.get("rays_from_afar", 0.0)
    assert hits.hit.any() and afar == 0     # the host moved the origins of these rays
    assert pictures[0].std() > 5
    assert (pictures[0] == pictures[1]).all()


def test_lists_are_in_order() -> None:
    """The triangles of each list are sorted by their nearest coordinate along the list's axis."""
    scene = soup_scene(150, 60)
    field = build_visibility_field(scene.triangles)
    beam = np.repeat(np.arange(len(field.beam_start) - 1), np.diff(field.beam_start))
    same = beam[1:] == beam[:-1]
    assert (np.diff(field.near)[same] >= 0).all()
    assert (field.reach >= field.far).all() and (np.diff(field.reach)[same] >= 0).all()
    fresh = np.r_[True, ~same]
    assert (field.reach[fresh] == field.far[fresh]).all()
    assert len(field.triangle) <= EXACT_INTEGER
    with rt.Tracer(scene, "ray-classification") as tracer:
        tracer.trace(*rays_everywhere(300, 60))
        boxes = tracer.accelerator.structure
    inside = (boxes.triangle[1:] >= 0) & (boxes.triangle[:-1] >= 0)
    assert (np.diff(boxes.near)[inside] >= 0).all()
