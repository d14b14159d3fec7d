"""After triangles move, an updated tracer finds the same hits as a new tracer, bit for bit."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import RAY_SETS, assert_same_bits, random_soup, variants

import gpgpu_rt as rt
from gpgpu_rt.accel.bounds import half_area
from gpgpu_rt.gl import textures
from gpgpu_rt.methods import built_in_methods, find_method
from gpgpu_rt.methods.bvh.build import build_bvh
from gpgpu_rt.methods.bvh.refit import Refitter
from gpgpu_rt.methods.quality import sah_cost
from gpgpu_rt.traversal import packets

SEED = 41
COUNT = 300


def moved(triangles: np.ndarray, amount: float, seed: int) -> np.ndarray:
    """Return the triangles, each moved by its own random offset. Triangle 4 becomes a point."""
    rng = np.random.default_rng(seed)
    after = triangles + amount * rng.normal(size=(len(triangles), 1, 3)).astype(np.float32)
    after[4] = after[4, :1]
    return after.astype(np.float32)


def scene_of(triangles: np.ndarray) -> rt.Scene:
    return rt.Scene.from_arrays(triangles.reshape(-1, 3), np.arange(
        3 * len(triangles)).reshape(-1, 3), name="soup")


@pytest.mark.parametrize("seed", [SEED], ids="seed{}".format)
@pytest.mark.parametrize("method, options", [
    pytest.param(row.name, {**options, **schedule},
                 id="-".join([row.name, *map(str, {**options, **schedule}.values())]),
                 marks=() if not schedule and (not options or row.refit) else pytest.mark.full)
    for row in rt.methods() for options in variants(row.name)
    for schedule in ({}, {"schedule": "step"}) if not schedule
    or "step" in row.schedules_for(options)])
def test_an_updated_tracer_equals_a_new_tracer(precise_renderer, method: str, options: dict,
                                               seed: int) -> None:
    row = find_method(method)
    triangles = random_soup(COUNT, seed)
    triangles[9] = triangles[9, :1]
    with rt.Tracer(scene_of(triangles), method, **options) as tracer:
        for step, amount in enumerate((0.05, 3.0, 0.0)):
            after = moved(triangles, amount, seed + step)
            tracer.update(after if step else after.reshape(-1, 3))
            rays = RAY_SETS["random"](scene_of(after), 500, step)
            with rt.Tracer(scene_of(after), "brute-force") as fresh:
                expected = fresh.trace(*rays)
            hits = tracer.trace(*rays)
            assert hits.hit.any() and not hits.status.any()
            assert_same_bits(hits, expected)
            assert tracer.statistics.rebuilt or row.refit is not None


@pytest.mark.parametrize("method", [row.name for row in built_in_methods()
                                    if row.stack or row.stack_entry is not None])
def test_trees_of_like_depth_share_programs(gpu, method: str) -> None:
    """Trees of slightly different depth use the same programs.

    The number of entries of a stack's array is rounded up to a multiple of 8. A tree with one more
    level therefore rarely needs a new program.
    """
    depths, made = set(), set()
    for seed, count in enumerate((20, 30, 45)):
        scene = scene_of(random_soup(count, seed))
        with rt.Tracer(scene, method) as tracer:
            tracer.trace(*RAY_SETS["random"](scene, 64, 1))
            depths.add(tracer.accelerator.structure.depth)
            size = tracer.accelerator.defines.get("STACK_SIZE")
            assert size is None or size >= tracer.accelerator.stack_levels
            made |= set(gpu.programs)
        if seed == 0:
            first = set(made)
    assert len(depths) > 1 and len({-(-depth // 8) for depth in depths}) == 1
    assert made == first


@pytest.mark.parametrize("octants", [False, True])
def test_pictures_move_too(precise_renderer, octants: bool) -> None:
    """After an update, pictures show the new triangles. The update makes no program and no
    texture."""
    triangles = random_soup(COUNT, 2)
    after = moved(triangles, 0.3, 3)
    with rt.Tracer(scene_of(triangles), "bvh-threaded", octants=octants) as tracer:
        camera = tracer.scene.camera
        first = np.asarray(tracer.render(camera, (24, 24)))
        tables = {name: texture.glo for textures in tracer.session.tables.values()
                  for name, texture in textures.items()}
        programs = len(tracer.gpu.programs)
        tracer.update(after)
        image = np.asarray(tracer.render(camera, (24, 24)))
        assert not tracer.statistics.rebuilt and tracer.statistics.refit_seconds > 0
        assert len(tracer.gpu.programs) == programs
        assert tables == {name: texture.glo for textures in tracer.session.tables.values()
                          for name, texture in textures.items()}
        light = tracer.scene.light
    expected = scene_of(after)
    expected.light = light
    with rt.Tracer(expected, "bvh-threaded", octants=octants) as fresh:
        assert (np.asarray(fresh.render(camera, (24, 24))) == image).all()
    assert (first != image).any()


@pytest.mark.parametrize("ratio, rebuilt", [(np.inf, False), (1e6, False), (1.2, True), (0, True)])
def test_the_ratio_decides(ratio: float, rebuilt: bool) -> None:
    """A tree is rebuilt if its cost after a refit is more than `rebuild_ratio` times its cost
    after the last build."""
    triangles = random_soup(COUNT, 5, size=0.02)
    shuffled = triangles[np.random.default_rng(1).permutation(COUNT)]   # the worst case of a refit
    with rt.Tracer(scene_of(triangles), "bvh-threaded", rebuild_ratio=ratio) as tracer:
        before = sah_cost(tracer.accelerator.structure)
        tracer.update(shuffled)
        assert tracer.statistics.rebuilt == rebuilt
        after = sah_cost(tracer.accelerator.structure)
        assert after < 1.01 * before if rebuilt else after > 1.2 * before
        built = tracer.statistics.build_seconds
        tracer.update(shuffled)     # the same triangles again: the cost has not risen
        assert tracer.statistics.rebuilt == (ratio == 0)
        assert ratio == 0 or tracer.statistics.build_seconds == built


def test_a_rebuilt_tree_is_the_new_measure() -> None:
    """After a rebuild, later costs are compared with the cost of the new tree. Larger triangles
    raise the cost of any tree, but cause only one rebuild."""
    triangles = random_soup(COUNT, 5, size=0.02)
    grown = triangles + 8 * (triangles - triangles.mean(axis=1, keepdims=True))
    with rt.Tracer(scene_of(triangles), "bvh-threaded") as tracer:
        tracer.update(grown)
        assert tracer.statistics.rebuilt
        tracer.update(grown)
        assert not tracer.statistics.rebuilt


@pytest.mark.parametrize("build", ["sah", "kay-kajiya"])
def test_refitted_boxes_are_exact(build: str) -> None:
    triangles, after = random_soup(COUNT, 6), random_soup(COUNT, 7)
    bvh = build_bvh(triangles, build=build)
    found = Refitter.of(bvh).refit(bvh, after)
    for node in range(0, len(bvh.escape), 7):
        inside = [i for i in range(node, bvh.escape[node]) if bvh.count[i]]
        corners = np.concatenate([after[bvh.order[bvh.first[i]:bvh.first[i] + bvh.count[i]]]
                                  for i in inside]).reshape(-1, 3)
        assert (found.lo[node] == corners.min(0)).all()
        assert (found.hi[node] == corners.max(0)).all()
    assert half_area(found.lo, found.hi, axis=1).min() >= 0
    same = Refitter.of(bvh).refit(bvh, triangles)
    assert (same.lo == bvh.lo).all() and (same.hi == bvh.hi).all()


def test_frames_do_not_fill_the_cache(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("GPGPU_RT_CACHE", str(tmp_path))
    triangles = random_soup(40, 8)
    with rt.Tracer(scene_of(triangles), "kd-restart") as tracer:
        assert len(list(tmp_path.iterdir())) == 1
        tracer.update(moved(triangles, 0.1, 9))
        assert tracer.statistics.rebuilt and len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize("vertices, message", [
    (np.zeros((899, 3)), "900 vertices"), (np.zeros((299, 3, 3)), r"\(300, 3, 3\)"),
    (np.full((900, 3), np.nan), "vertex 0"), (np.full((300, 3, 3), np.inf), "triangle 0"),
    (np.zeros((900, 2)), "shape"), ("abc", "numbers")])
def test_vertices_that_do_not_fit_change_nothing(vertices, message: str) -> None:
    scene = scene_of(random_soup(COUNT, 10))
    rays = RAY_SETS["random"](scene, 200, 1)
    with rt.Tracer(scene) as tracer:
        before = tracer.trace(*rays)
        with pytest.raises(rt.SceneError, match=message) as caught:
            tracer.update(vertices)
        assert "\n" not in str(caught.value)
        assert tracer.scene is scene
        assert_same_bits(tracer.trace(*rays), before)


def test_tables_that_do_not_fit_change_nothing(monkeypatch) -> None:
    """If the tree of moved triangles exceeds a limit, tree and tables stay as they were."""
    triangles = random_soup(COUNT, 10)
    scene = scene_of(triangles)
    rays = RAY_SETS["random"](scene, 500, 3)
    with rt.Tracer(scene, "kd-restart") as tracer:
        before, check = tracer.trace(*rays), textures.check_count

        def limit(name: str, count: int) -> None:
            if name == "kd_node":
                raise rt.LimitError("too many")
            check(name, count)
        monkeypatch.setattr(textures, "check_count", limit)
        with pytest.raises(rt.LimitError, match="too many"):
            tracer.update(moved(triangles, 0.1, 10))
        monkeypatch.undo()
        assert_same_bits(tracer.trace(*rays), before)
        tracer.update(moved(triangles, 0.1, 10))
        assert (tracer.trace(*rays).t != before.t).any()


def test_the_scene_that_was_given_stays() -> None:
    scene = scene_of(random_soup(COUNT, 11))
    kept = scene.triangles.copy()
    with rt.Tracer(scene) as tracer:
        tracer.update(moved(kept, 1.0, 12))
        assert (scene.triangles == kept).all() and (tracer.scene.triangles != kept).any()


@pytest.mark.parametrize("method", ["kd-restart", "grid", "bvh-threaded", "kd-packet"])
def test_two_tracers_in_turn(precise_renderer, method: str) -> None:
    """Two tracers share programs, but each tracer sets its own uniforms."""
    scenes = [scene_of(random_soup(COUNT, 13)), scene_of(random_soup(COUNT, 14) * 40 + 7)]
    rays = [RAY_SETS["random"](scene, 300, 2) for scene in scenes]
    with rt.Tracer(scenes[0], method) as one, rt.Tracer(scenes[1], method) as other:
        first = [tracer.trace(*r) for tracer, r in zip((one, other), rays)]
        again = [tracer.trace(*r) for tracer, r in zip((one, other), rays)]
    for before, after in zip(first, again):
        assert before.hit.any()
        assert_same_bits(after, before)


@pytest.mark.parametrize("method, options", [
    pytest.param(row.name, options, id="-".join([row.name, *map(str, options.values())]))
    for row in rt.methods() if row.single is not None for options in ({}, {"octants": True})
    if set(options) <= {option.name for option in row.options}])
def test_rays_that_packets_leave_unfinished(precise_renderer, method: str, options: dict,
                                            monkeypatch) -> None:
    """A single-ray method finishes the rays that packets leave unfinished. The tables of this
    method must be updated too."""
    monkeypatch.setattr(packets, "PACKET_STEPS", 12)
    triangles = random_soup(COUNT, 15)
    rays = RAY_SETS["random"](scene_of(triangles), 300, 3)
    with rt.Tracer(scene_of(triangles), method, **options) as tracer:
        for amount in (0.0, 0.2, 0.4):
            after = moved(triangles, amount, 16)
            tracer.update(after)
            hits = tracer.trace(*rays)
            assert tracer.session.driver.kept.get("single") is not None and not hits.status.any()
            with rt.Tracer(scene_of(after), "brute-force") as fresh:
                assert_same_bits(hits, fresh.trace(*rays))
