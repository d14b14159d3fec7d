"""Every row of the method table finds brute force's hits, and the oracle's."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import (
    FOLEY, RAY_SETS, assert_same_bits, assert_same_hits, random_soup, real_scene, schedules_of,
    soup_scene
)

import gpgpu_rt as rt
from gpgpu_rt.methods import find_method


def variants(name: str) -> list[dict[str, object]]:
    """Settings of a method that change what its programs do: each choice of its own options."""
    settings: list[dict[str, object]] = [{}]
    for option in find_method(name).options:
        if option.choices:
            settings += [{option.name: c} for c in option.choices
                         if c != option.default and c not in option.relaxed]
        elif option.kind is bool:
            settings.append({option.name: not option.default})
    return settings


CASES = [pytest.param(row.name, options, id="-".join([row.name, *map(str, options.values())]))
         for row in rt.methods() for options in variants(row.name)]
SCHEDULE_CASES = [pytest.param(*case.values, settings, id=f"{case.id}-{name}")
                  for case in CASES
                  for name, settings in schedules_of(find_method(case.values[0])).items()]


def trace(scene: rt.Scene, method: str, rays, **options) -> rt.Hits:
    with rt.Tracer(scene, method, **options) as tracer:
        hits = tracer.trace(*rays)
    assert not hits.status.any()
    return hits


def few_full(few: int, full: int) -> list:
    return [pytest.param(few, id=f"n{few}"), pytest.param(full, id=f"n{full}",
                                                          marks=pytest.mark.full)]


@pytest.mark.small
@pytest.mark.parametrize("rays", RAY_SETS)
@pytest.mark.parametrize("method, options", CASES)
def test_soup_matches_oracle(method: str, options: dict, rays: str) -> None:
    scene = soup_scene(300, seed=5)
    chosen = RAY_SETS[rays](scene, 1024, 17)
    oracle = rt.reference.trace(scene, *chosen)
    hits = trace(scene, method, chosen, **options)
    # Rays aimed at vertices and edges of a soup graze: which side they pass is rounding's to say.
    assert_same_hits(hits, oracle, scene.extent, 0.4 if rays in ("vertices", "edges") else 0.002)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("rays", RAY_SETS)
@pytest.mark.parametrize("method, options", CASES)
def test_soup_matches_brute_force(exact_renderer, method: str, options: dict, rays: str,
                                  seed: int) -> None:
    scene = soup_scene(400, seed)
    chosen = RAY_SETS[rays](scene, 4096, seed)
    assert_same_bits(trace(scene, method, chosen, **options), trace(scene, "brute-force", chosen))


@pytest.mark.parametrize("method, options, schedule", SCHEDULE_CASES)
def test_schedules_agree(exact_renderer, method: str, options: dict, schedule: dict) -> None:
    scene = soup_scene(250, seed=9)
    for rays in ("eye", "random"):
        chosen = RAY_SETS[rays](scene, 1600, 4)
        best = trace(scene, method, chosen, **options)
        assert best.hit.any() and not best.hit.all()
        assert_same_bits(trace(scene, method, chosen, **schedule, **options), best)


@pytest.mark.parametrize("method, options, schedule", SCHEDULE_CASES)
def test_any_hit_agrees_with_closest(method: str, options: dict, schedule: dict) -> None:
    scene = soup_scene(250, seed=10)
    origins, directions = RAY_SETS["random"](scene, 1500, 3)
    closest = rt.reference.trace(scene, origins, directions)
    with rt.Tracer(scene, method, **schedule, **options) as tracer:
        assert (tracer.occluded(origins, directions) != closest.hit).mean() < 0.002
        short = np.where(closest.hit, closest.t * 0.999, 1.0)
        assert tracer.occluded(origins, directions, short).mean() < 0.002
        long = np.where(closest.hit, closest.t * 1.001, 1.0)
        assert (tracer.occluded(origins, directions, long)[closest.hit]).mean() > 0.998


@pytest.mark.parametrize("rays", ["eye", "random", "surface"])
@pytest.mark.parametrize("name", FOLEY)
def test_real_scene_matches_oracle(name: str, rays: str) -> None:
    """Quick: every method on 4,096 rays of each kind, against the float64 oracle."""
    scene = real_scene(name)
    chosen = RAY_SETS[rays](scene, 4096, 23)
    oracle = rt.reference.trace(scene, *chosen, accelerated=True)
    for row in rt.methods():
        if row.name != "brute-force":
            hits = trace(scene, row.name, chosen)
            assert_same_hits(hits, oracle, scene.extent, 1e-4)


@pytest.mark.full
@pytest.mark.parametrize("rays", ["eye", "random", "surface"])
@pytest.mark.parametrize("name", FOLEY)
def test_real_scene_bars(exact_renderer, name: str, rays: str) -> None:
    """65,536 rays: all methods, builds and schedules against brute force and the oracle."""
    scene = real_scene(name)
    chosen = RAY_SETS[rays](scene, 65_536, 29)
    brute = trace(scene, "brute-force", chosen)
    oracle = rt.reference.trace(scene, *chosen, accelerated=True)
    assert_same_hits(brute, oracle, scene.extent, 1e-4)
    for row in rt.methods():
        for options in variants(row.name):
            if row.name == "brute-force" or options.get("build") == "goldsmith-salmon":
                continue
            best = trace(scene, row.name, chosen, **options)
            assert_same_bits(best, brute, 1e-5)
            assert_same_hits(best, oracle, scene.extent, 1e-4)
            if not options:
                for schedule in schedules_of(row, ("step16", "step1", "kernels")).values():
                    assert_same_bits(trace(scene, row.name, chosen, **schedule), best)


@pytest.mark.parametrize("method", [row.name for row in rt.methods() if row.name != "brute-force"])
def test_a_hit_ends_the_search(method: str) -> None:
    """A wall before the soup spares rays what lies behind it, in some setting of each method."""
    wall = np.float32([[[-3, -3, 1.5], [3, -3, 1.5], [0, 4, 1.5]]])
    triangles = np.concatenate([wall, random_soup(1500, seed=6, size=0.03)])
    scene = rt.Scene.from_arrays(triangles.reshape(-1, 3),
                                 np.arange(triangles.size // 3).reshape(-1, 3))
    start = np.random.default_rng(3).random((600, 3)).astype(np.float32) * np.float32([1, 1, 0])
    directions = np.tile(np.float32([0.01, 0.02, -1]), (600, 1))
    shares = {}
    for options in variants(method):
        before, behind = (trace(scene, method, (start + np.float32([0, 0, z]), directions),
                                statistics=True, **options) for z in (1.6, 1.4))
        assert (before.triangle == 0).all() and (behind.triangle != 0).all()
        missed = ~behind.hit
        shares[str(options)] = (before.nodes_visited[missed].mean()
                                / behind.nodes_visited[missed].mean())
    assert min(shares.values()) < 0.5, shares
