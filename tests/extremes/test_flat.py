"""Row 41 of the catalogue of extreme cases (docs/extremes.md): scenes that are flat along an axis,
and rays that start on or near the plane of the scene.

All hits equal the hits of brute force to the bit, even if a ray's interval contains only the t of
its hit. A method that skipped a box around this hit would fail. The hits of brute force are within
the derived error bounds.
"""
from __future__ import annotations

import functools

import numpy as np
import pytest
from conftest import assert_same_bits, part_of, schedules_of, variants

import gpgpu_rt as rt
from gpgpu_rt.accuracy.judge import judge
from gpgpu_rt.conform.case import Case
from gpgpu_rt.conform.flat_families import FLATS, Flat

QUICK = [Flat(0, 0.0), Flat(1, 0.0, count=2)]
SLOW_TO_INSERT = 100  # with more triangles than this, inserting them singly is slow
MILLION = 10**6


def name_of(flat: Flat) -> str:
    slope = "tilted" if flat.tilted else "level"
    return f"{'xyz'[flat.axis]}{flat.at:g}{flat.spacings:+d}-{slope}-{flat.count}"


@functools.lru_cache(maxsize=len(FLATS) * 4)
def traced(flat: Flat, rays: int, seed: int, together: bool = False) -> tuple[Case, rt.Hits]:
    """Returns a case and the hits of brute force."""
    case = flat.case(rays, seed, together)
    with rt.Tracer(case.scene, "brute-force") as tracer:
        return case, tracer.trace(case.origins, case.directions, case.t_min)


def check(flat: Flat, rays: int, seed: int, method: str, **options) -> int:
    """Compares a method's hits with the hits of brute force; returns the number of rays."""
    count = 0
    with rt.Tracer(flat.case(1, seed).scene, method, **options) as tracer:
        for together in (False, True):
            case, brute = traced(flat, rays, seed, together)
            given = case.origins, case.directions
            assert_same_bits(tracer.trace(*given, case.t_min), brute)
            hit = np.flatnonzero(brute.hit)
            pinned = tracer.trace(*(a[hit] for a in given), brute.t[hit], brute.t[hit])
            assert_same_bits(pinned, part_of(brute, hit))
            assert np.array_equal(tracer.occluded(*given, t_min=case.t_min), brute.hit)
            count += rays
    return count


@pytest.mark.parametrize("seed", [1], ids="seed{}".format)
@pytest.mark.parametrize("flat", [QUICK[0], *FLATS[::23]], ids=name_of)
def test_brute_force_is_right(flat: Flat, seed: int) -> None:
    """The hits of brute force are within the derived error bounds. For rays that start near the
    plane, t may have the wrong sign, but the error of t is within its bound."""
    for together in (False, True):
        case, hits = traced(flat, 1000, seed, together)
        verdict = judge(case.triangles, case.origins, case.directions, hits, case.t_min)
        assert not verdict.wrong.any(), verdict.counts
        assert 0.02 < hits.hit.mean() < 1 or together


@pytest.mark.parametrize("seed", [2], ids="seed{}".format)
@pytest.mark.parametrize("flat", QUICK, ids=name_of)
@pytest.mark.parametrize("method", [row.name for row in rt.methods()
                                    if row.name != "brute-force"])
def test_every_method_returns_the_bits_of_brute_force(precise_renderer, method: str, flat: Flat,
                                                      seed: int) -> None:
    check(flat, 2000, seed, method)


def test_every_hit_is_found_again(precise_renderer) -> None:
    """`trace_all` finds the hits of all coplanar triangles at one t. Each of its searches begins
    at the t of the hit that the previous search found."""
    case, brute = traced(QUICK[0], 300, 3)
    counts = []
    for method in ("brute-force", "bvh-threaded", "bih"):
        with rt.Tracer(case.scene, method) as tracer:
            found = tracer.trace_all(case.origins, case.directions, case.t_min)
        counts.append((found.ray.tolist(), found.triangle.tolist(), found.t.tolist()))
    assert len(counts[0][0]) > brute.hit.sum() and counts[1:] == counts[:1] * 2


# Full sizes --------------------------------------------------------------------------------------

def settings() -> list:
    """Returns each method with each choice of its options, and each method under each schedule."""
    found = [(row.name, options) for row in rt.methods()
             for options in (*variants(row.name), *schedules_of(row).values())]
    return [pytest.param(name, options, id="-".join([name, *map(str, options.values())]))
            for name, options in found if name != "brute-force" or options]


@pytest.mark.full
@pytest.mark.once
@pytest.mark.parametrize("seed", [11], ids="seed{}".format)
@pytest.mark.parametrize("method, options", settings())
def test_a_million_rays(precise_renderer, method: str, options: dict, seed: int) -> None:
    """Each method traces a million rays, in equal shares in all flat scenes. With options,
    only every seventh scene is used; these scenes include each axis, place and size."""
    flats = FLATS if not options else FLATS[::7]
    rays = -(-MILLION // (2 * len(flats)))
    if options.get("build") == "goldsmith-salmon":
        flats = [flat for flat in flats if flat.count <= SLOW_TO_INSERT]
    for flat in flats:
        check(flat, rays, seed, method, **options)
