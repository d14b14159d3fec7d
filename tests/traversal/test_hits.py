"""Every method of the method table finds the hits of brute force and of the oracle, which is the
float64 reference."""
from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
import pytest
from conftest import (
    FOLEY, RAY_SETS, UNSTRUCTURED, assert_same_bits, assert_same_hits, part_of, random_soup,
    real_scene, schedules_of, soup_scene, variant_pairs, variants
)

import gpgpu_rt as rt
from gpgpu_rt.methods import find_method

# Builder options, which change the tree but no program.
BUILDS = {"split", "build", "build_device"}
QUICK_SCENES = ("cornell", "bunny")  # the real scenes of the quick suite


def cases(in_full: Callable[[dict[str, object]], bool]) -> list:
    """Returns every method with each choice of its options. ``in_full`` selects the options that
    only the full suite tests."""
    return [pytest.param(row.name, options, id="-".join([row.name, *map(str, options.values())]),
                         marks=pytest.mark.full if in_full(options) else ())
            for row in rt.methods() for options in variants(row.name)]


CASES = cases(lambda options: False)
PLAIN_FIRST = cases(bool)


def schedule_cases(of_plain: tuple[str, ...], of_variants: tuple[str, ...]) -> list:
    """Returns every case under every schedule.

    In the quick suite, methods with default options run under the schedules ``of_plain``. Options
    that change a program run under ``of_variants``.
    """
    found = []
    for case in CASES:
        method, options = case.values
        quick = of_plain if not options else of_variants if not BUILDS & set(options) else ()
        for name, settings in schedules_of(find_method(method), options=options).items():
            found.append(pytest.param(method, options, settings, id=f"{case.id}-{name}",
                                      marks=() if name in quick else pytest.mark.full))
    return found


def trace(scene: rt.Scene, method: str, rays, **options) -> rt.Hits:
    with rt.Tracer(scene, method, **options) as tracer:
        hits = tracer.trace(*rays)
    assert not hits.status.any()
    return hits


def rays_for(method: str, rays: int) -> int:
    """Returns the number of rays for a method. Two kinds of methods are slow and get fewer rays:
    methods that draw a pass per step, and methods whose rays share candidate lists. Few random
    rays share a list, so making the lists takes longer than tracing the rays."""
    row = find_method(method)
    lists = "budget" in {option.name for option in row.options}
    return rays if "loop" in row.schedules and not lists else rays // 16


@functools.lru_cache(maxsize=32)
def brute(count: int, seed: int, kind: str, rays: int) -> tuple:
    """Returns a soup, its rays, and the hits of brute force."""
    scene = soup_scene(count, seed)
    chosen = RAY_SETS[kind](scene, rays, seed)
    return scene, chosen, trace(scene, "brute-force", chosen)


@functools.lru_cache(maxsize=32)
def oracle(count: int, seed: int, kind: str, rays: int, ray_seed: int) -> tuple:
    """Returns a soup, its rays, and the hits of the float64 reference."""
    scene = soup_scene(count, seed)
    chosen = RAY_SETS[kind](scene, rays, ray_seed)
    return scene, chosen, rt.reference.trace(scene, *chosen)


@pytest.mark.small
@pytest.mark.parametrize("rays", RAY_SETS)
@pytest.mark.parametrize("method, options", PLAIN_FIRST)
def test_soup_matches_oracle(method: str, options: dict, rays: str) -> None:
    scene, chosen, expected = oracle(300, 5, rays, 1024, 17)
    hits = trace(scene, method, chosen, **options)
    # Rays that aim at vertices and edges of a soup graze them. Rounding decides on which side a
    # ray passes.
    assert_same_hits(hits, expected, scene.extent, 0.4 if rays in ("vertices", "edges") else 0.002)


# The quick suite tests methods without options with all kinds of rays. It tests options with
# random rays and rays at edges.
@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.full)
                                       for seed in (2, 3))])
@pytest.mark.parametrize("method, options, rays", [
    pytest.param(*case.values, rays, id=f"{case.id}-{rays}",
                 marks=pytest.mark.full if case.values[1] and rays not in ("random", "edges")
                 else ()) for case in CASES for rays in RAY_SETS])
def test_soup_matches_brute_force(precise_renderer, method: str, options: dict, rays: str,
                                  seed: int) -> None:
    scene, chosen, expected = brute(400, seed, rays, rays_for(method, 4096))
    assert_same_bits(trace(scene, method, chosen, **options), expected)


# These schedules exclude (mask) finished rays at different times. The quick suite skips
# options that change no program.
@pytest.mark.parametrize("method, options, schedule", schedule_cases(
    ("step1", "step16", "step1-mask3", "kernels", "kernels-mask2"), ("step16", "kernels")))
def test_schedules_agree(precise_renderer, method: str, options: dict, schedule: dict) -> None:
    scene = soup_scene(120, seed=9)
    origins, directions = (np.concatenate(both) for both in zip(
        # more rays than a row of texels
        *(RAY_SETS[rays](scene, 676, 4) for rays in ("eye", "random"))))
    best = trace(scene, method, (origins, directions), **options)
    assert best.hit.any() and not best.hit.all()
    assert_same_bits(trace(scene, method, (origins, directions), **schedule, **options), best)


@pytest.mark.parametrize("method, options, schedule", schedule_cases(
    ("loop", "step1", "step16", "kernels"), ()))
def test_any_hit_agrees_with_closest(method: str, options: dict, schedule: dict) -> None:
    """`occluded` agrees with the nearest hits. The intervals of the rays are infinite, end just
    before the nearest hit, or end just behind it."""
    scene, (origins, directions), closest = oracle(150, 10, "random", 1000, 3)
    ends = np.concatenate([np.full(1000, np.inf), np.where(closest.hit, closest.t * 0.999, 1.0),
                           np.where(closest.hit, closest.t * 1.001, 1.0)])
    with rt.Tracer(scene, method, **schedule, **options) as tracer:
        open_end, short, long = tracer.occluded(
            np.tile(origins, (3, 1)), np.tile(directions, (3, 1)), ends).reshape(3, -1)
    assert closest.hit.mean() > 0.1
    assert (open_end != closest.hit).mean() < 0.002
    assert short.mean() < 0.002
    assert long[closest.hit].mean() > 0.998


@pytest.mark.parametrize("name", [
    name if name in QUICK_SCENES else pytest.param(name, marks=pytest.mark.full)
    for name in FOLEY])
def test_real_scene_matches_oracle(name: str) -> None:
    """Every method but brute force agrees with the float64 oracle on up to 4,096 rays of each
    kind. In the quick suite, methods that may test all triangles for each ray trace only 64 rays
    of each kind."""
    scene = real_scene(name)
    sets = [RAY_SETS[rays](scene, 4096, 23) for rays in ("eye", "random", "surface")]
    truths = [rt.reference.trace(scene, *chosen, accelerated=True) for chosen in sets]
    for row in rt.methods():
        if row.name == "brute-force":
            continue
        brief = row.name in UNSTRUCTURED and name in QUICK_SCENES
        few = 64 if brief else rays_for(row.name, 4096)
        some = slice(None, None, 4096 // few)
        with rt.Tracer(scene, row.name) as tracer:
            for (origins, directions), expected in zip(sets, truths):
                hits = tracer.trace(origins[some], directions[some])
                assert not hits.status.any()
                assert_same_hits(hits, part_of(expected, some), scene.extent, 1e-4)


@pytest.mark.full
@pytest.mark.once
@pytest.mark.parametrize("rays", ["eye", "random", "surface"])
@pytest.mark.parametrize("name", FOLEY)
def test_real_scenes_match_brute_force_and_oracle(precise_renderer, name: str, rays: str) -> None:
    """All methods and schedules, and all builds but `goldsmith-salmon`, agree with brute force and
    the oracle on up to 65,536 rays.

    A method is slow if it shares lists between rays, has no acceleration structure, or draws a
    pass per step. A slow method traces all eye rays once, with its default settings. In all other
    runs, a slow method traces only every sixteenth ray.
    """
    scene = real_scene(name)
    chosen = RAY_SETS[rays](scene, 65_536, 29)
    exhaustive = trace(scene, "brute-force", chosen)
    expected = rt.reference.trace(scene, *chosen, accelerated=True)

    def checked(row: rt.Method, some: slice, **settings: object) -> rt.Hits:
        hits = trace(scene, row.name, tuple(a[some] for a in chosen), **settings)
        assert_same_bits(hits, part_of(exhaustive, some), 1e-5)
        assert_same_hits(hits, part_of(expected, some), scene.extent, 1e-4)
        return hits

    assert_same_hits(exhaustive, expected, scene.extent, 1e-4)
    for row in rt.methods():
        if row.name == "brute-force":
            continue
        fewer = row.name in UNSTRUCTURED or rays_for(row.name, 16) < 16
        some = slice(None, None, 16 if fewer else None)
        if fewer and rays == "eye":
            checked(row, slice(None))
        best = checked(row, some)
        for options in variants(row.name)[1:]:
            if options.get("build") != "goldsmith-salmon":
                checked(row, some, **options)
        for schedule in schedules_of(row, ("step16", "step1", "kernels")).values():
            # `best` already covers the default schedule
            if row.resolved(schedule) != row.resolved({}):
                assert_same_bits(checked(row, some, **schedule), best)


@pytest.mark.parametrize("method", [row.name for row in rt.methods() if row.name != "brute-force"])
def test_a_hit_ends_the_search(method: str) -> None:
    """Rays that miss the soup visit many nodes. A wall in front of the soup stops these rays
    early. With at least one setting of each method, the rays then visit less than half as many
    nodes."""
    wall = np.float32([[[-3, -3, 1.5], [3, -3, 1.5], [0, 4, 1.5]]])
    triangles = np.concatenate([wall, random_soup(1500, seed=6, size=0.03)])
    scene = rt.Scene.from_arrays(triangles.reshape(-1, 3),
                                 np.arange(triangles.size // 3).reshape(-1, 3))
    start = np.random.default_rng(3).random((600, 3)).astype(np.float32) * np.float32([1, 1, 0])
    directions = np.tile(np.float32([0.01, 0.02, -1]), (600, 1))
    shares: dict[str, float] = {}
    for options in variants(method):
        before, behind = (trace(scene, method, (start + np.float32([0, 0, z]), directions),
                                statistics=True, **options) for z in (1.6, 1.4))
        assert (before.triangle == 0).all() and (behind.triangle != 0).all()
        missed = ~behind.hit
        shares[str(options)] = (before.nodes_visited[missed].mean()
                                / behind.nodes_visited[missed].mean())
        if shares[str(options)] < 0.5:
            return
    pytest.fail(str(shares))


@pytest.mark.full
@pytest.mark.parametrize("method, options", [
    pytest.param(row.name, options, id="-".join([row.name, *map(str, options.values())]))
    for row in rt.methods() for options in variant_pairs(row.name)])
def test_options_in_pairs(precise_renderer, method: str, options: dict) -> None:
    """With every pair of options, hits agree with brute force. The scene's flat walls have boxes
    of zero thickness, which outward rounding makes thicker."""
    scene = rt.load_scene("cornell")
    for rays in ("eye", "edges"):
        chosen = RAY_SETS[rays](scene, 1024, 6)
        assert_same_bits(trace(scene, method, chosen, **options),
                         trace(scene, "brute-force", chosen))
