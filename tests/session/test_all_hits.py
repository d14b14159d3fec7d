"""With every method, `trace_all` finds, in order of t, the same hits as a test of each ray against
each triangle."""
from __future__ import annotations

import multiprocessing
import pickle
import subprocess
import sys

import numpy as np
import pytest
from conftest import RAY_SETS, random_soup, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.numerics.watertight import intersect_pairs

METHODS = {row.name: row for row in rt.methods()}


def doubled_soup(seed: int, count: int = 40) -> rt.Scene:
    """Return a scene of random triangles, a third of which occur two or three times."""
    triangles = random_soup(count, seed)
    triangles = np.concatenate([triangles, triangles[::3], triangles[::6, [1, 2, 0]]])
    corners = triangles[np.random.default_rng(seed).permutation(len(triangles))].reshape(-1, 3)
    return rt.Scene.from_arrays(corners, np.arange(len(corners)).reshape(-1, 3))


def rays_through(scene: rt.Scene, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return random rays and rays that aim at vertices.

    The lengths of the directions are not powers of two. One ray starts far away.
    """
    kinds = [RAY_SETS[kind](scene, 60, seed) for kind in ("random", "vertices")]
    origins, directions = (np.concatenate(arrays) for arrays in zip(*kinds))
    directions = directions * np.float32(3.7)
    origins[5] -= directions[5] * np.float32(3000)
    return origins, directions


def all_pairs(scene: rt.Scene, origins: np.ndarray, directions: np.ndarray, t_min: float = 0.0,
              t_max: float = np.inf) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return ray, t and triangle of all hits, found by the watertight test's numpy version."""
    ray, triangle = np.divmod(np.arange(len(origins) * len(scene)), len(scene))
    accepted, t, _, _ = intersect_pairs(scene.triangles[triangle], origins[ray], directions[ray])
    accepted &= (t >= np.float32(t_min)) & (t <= np.float32(t_max))
    ray, t, triangle = ray[accepted], t[accepted], triangle[accepted]
    order = np.lexsort((triangle, t, ray))
    return ray[order], t[order], triangle[order]


@pytest.mark.parametrize("seed", [1], ids="seed{}".format)
@pytest.mark.parametrize("method, schedule", [
    pytest.param(name, schedule, id=f"{name}-{schedule}",
                 marks=() if schedule == row.schedules[-1] else pytest.mark.full)
    for name, row in METHODS.items() for schedule in row.schedules])
def test_all_hits_equal_the_hits_of_all_pairs(exact_renderer, method: str, schedule: str,
                                              seed: int) -> None:
    scene = doubled_soup(seed)
    origins, directions = rays_through(scene, seed)
    # Leave out the far ray: the tracer moves the ray's origin, so t rounds differently.
    origins = np.delete(origins, 5, 0)
    directions = np.delete(directions, 5, 0)
    ray, t, triangle = all_pairs(scene, origins, directions)
    assert len(np.unique(np.column_stack([ray, t.view(np.int32)]), axis=0)) < len(t) - 20
    with rt.Tracer(scene, method, schedule=schedule) as tracer:
        first = tracer.trace(origins, directions)
        hits = tracer.trace_all(origins, directions)
        again = tracer.trace(origins, directions)
        few = tracer.trace_all(origins, directions, max_hits=2)
        part = tracer.trace_all(origins, directions, t_min=0.05, t_max=0.2)
    assert hits.ray.tolist() == ray.tolist() and hits.triangle.tolist() == triangle.tolist()
    assert (hits.t == t).all() and not hits.status.any()
    assert (hits.count == np.bincount(ray, minlength=len(origins))).all()
    begins = np.flatnonzero(np.diff(ray, prepend=-1))
    for name in ("t", "u", "v", "triangle"):
        assert (getattr(hits, name)[begins] == getattr(first, name)[first.hit]).all()
        assert (getattr(again, name) == getattr(first, name)).all()
    kept = np.arange(len(ray)) - np.repeat(begins, np.diff(begins, append=len(ray))) < 2
    assert few.triangle.tolist() == triangle[kept].tolist()
    expected = all_pairs(scene, origins, directions, 0.05, 0.2)
    assert part.ray.tolist() == expected[0].tolist()
    assert part.triangle.tolist() == expected[2].tolist()


@pytest.mark.parametrize("seed", [2], ids="seed{}".format)
@pytest.mark.parametrize("options", [
    {"method": "bvh-threaded", "octants": True, "quantise_nodes": 8},
    {"method": "bvh-packet", "packet": (4, 4)}, {"method": "kd-packet", "packet": (4, 4)},
    {"method": "kd-short-stack", "sort_rays": True}, {"method": "grid", "intersection": "plucker"},
    {"method": "ray-engine", "cpu_below": 4}, {"method": "ray-engine", "cpu_below": 0},
], ids=lambda options: "-".join(map(str, options.values())))
def test_options_change_no_hit(exact_renderer, options: dict, seed: int) -> None:
    scene = doubled_soup(seed)
    rays = rays_through(scene, seed)
    test = {"intersection": options.get("intersection", "woop-watertight")}
    with rt.Tracer(scene, "brute-force", **test) as tracer:
        expected = tracer.trace_all(*rays)
    with rt.Tracer(scene, **options) as tracer:
        hits = tracer.trace_all(*rays)
    assert len(hits) > 60
    for name in ("ray", "t", "u", "v", "triangle"):
        assert getattr(hits, name).tolist() == getattr(expected, name).tolist()


def test_rays_that_packets_leave_unfinished_get_all_hits(precise_renderer, monkeypatch) -> None:
    scene = doubled_soup(3, 200)
    rays = rays_through(scene, 3)
    with rt.Tracer(scene, "kd-packet") as tracer:
        expected = tracer.trace_all(*rays)
    monkeypatch.setattr("gpgpu_rt.traversal.packets.PACKET_STEPS", 40)
    with rt.Tracer(scene, "kd-packet") as tracer:
        hits = tracer.trace_all(*rays)
        assert tracer.statistics.passes > 2 * expected.count.max()
    assert hits.triangle.tolist() == expected.triangle.tolist()
    assert hits.ray.tolist() == expected.ray.tolist()


def test_invalid_rays_and_capped_rays_are_flagged() -> None:
    """`status` marks invalid rays and rays that a step cap stopped."""
    scene = doubled_soup(4)
    origins, directions = rays_through(scene, 4)
    origins[2], directions[4] = np.nan, 0
    with rt.Tracer(scene, "kd-restart") as tracer:
        with pytest.raises(ValueError, match="ray 2 is invalid"):
            tracer.trace_all(origins, directions)
        hits = tracer.trace_all(origins, directions, invalid="miss")
        assert not len(tracer.trace_all(np.zeros((0, 3)), np.zeros((0, 3))))
    assert np.flatnonzero(hits.status).tolist() == [2, 4] and not hits.count[[2, 4]].any()
    with rt.Tracer(scene, "kd-restart", step_cap=9) as tracer:
        cut = tracer.trace_all(origins, directions, invalid="miss")
    assert (cut.status == 2).any() and (cut.count <= hits.count).all()
    with rt.Tracer(rt.Scene.from_arrays([], []), "bvh-threaded") as tracer:
        assert not len(tracer.trace_all(origins, directions, invalid="miss"))


@pytest.mark.parametrize("method, options, what", [
    ("grid", {"precision": "fp16"}, "fp32 only"), ("grid", {"arithmetic": "fp24"}, "fp32 only"),
    ("ray-engine", {"nearest": "depth"}, "may lose hits"),
    ("kd-restart", {"interval": "nudge-absolute"}, "may lose hits")])
def test_options_that_may_lose_hits_are_refused(method: str, options: dict, what: str) -> None:
    with rt.Tracer(soup_scene(9, 1), method, **options) as tracer:
        with pytest.raises(rt.OptionError, match=what):
            tracer.trace_all([[0, 0, 0]], [[0, 0, 1]])


THREADS = """
import threading
import numpy as np
import gpgpu_rt as rt
scene = rt.load_scene("cornell")
origins, directions = scene.camera.rays((16, 16))
found = []
with rt.Tracer(scene, "kd-restart") as shared:
    def work():
        with rt.Tracer(scene, "grid") as own:
            for tracer in (own, shared, own, shared):
                found.append(tracer.trace(origins, directions).triangle.tolist())
    threads = [threading.Thread(target=work) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [shared.trace(origins, directions).triangle.tolist()] * 12
"""


def test_threads_share_a_tracer() -> None:
    """Several threads may share a tracer, and each thread may have its own tracer. The test needs
    its own process, because the current context of this process locks out other threads."""
    subprocess.run([sys.executable, "-c", THREADS], check=True, timeout=120)


def count_hits(tracer: rt.Tracer) -> int:
    return int(tracer.trace(*tracer.scene.camera.rays((8, 8))).hit.sum())


def test_tracers_are_sent_to_other_processes() -> None:
    with rt.Tracer("cornell", "kd-restart", schedule="step", steps_per_pass=8) as tracer:
        with pickle.loads(pickle.dumps(tracer)) as copy:
            assert copy.options == tracer.options and copy.method is tracer.method
            assert (copy.scene.triangles == tracer.scene.triangles).all()
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            assert pool.apply(count_hits, (tracer,)) == count_hits(tracer) > 0
        with multiprocessing.get_context("fork").Pool(1) as pool:
            with pytest.raises(rt.ContextError, match="does not outlive a fork"):
                pool.apply(rt.Tracer, ("cornell", "grid"))
