"""Tests every case of the catalogue with every method and each choice of the method's options. The
quick suite omits many of these combinations.

The catalogue is `gpgpu_rt/conform/families.py`. The tests check that the hits of brute force lie
within each ray's error bounds. Every other method must return the same bits as brute force, so
its hits are right too.
"""
from __future__ import annotations

import functools

import numpy as np
import pytest
from conftest import UNSTRUCTURED, assert_same_bits, variants

import gpgpu_rt as rt
from gpgpu_rt.accuracy.judge import judge
from gpgpu_rt.conform.case import FAMILIES, Case
from gpgpu_rt.conform.families import make_case, square_case
from gpgpu_rt.methods import find_method

QUICK, FULL = 512, 32_768
# The quick suite tests options of builders and of traversal in these cases; the full suite tests
# these options in all cases.
TELLING = ("moved-1e4", "in-planes", "box-corners", "flat-soup")
# The quick test of every method skips these cases: a case is slow to build, or another quick test
# covers the case for every method.
IN_FULL = ("scaled-2^-20", "scaled-2^20", "moved-1e0", "moved-1e2", "lengths", "coplanar",
           "one-triangle", "flat-floor")
# In these cases, a leaf or a cell lists very many triangles. A schedule with one pass per triangle
# is too slow for a quick test.
LONG_LISTS = ("coincident", "one-centroid")
# With more triangles than this, a builder that inserts triangles singly is too slow for a quick
# test.
SLOW_TO_INSERT = 3000
NAMES = [pytest.param(name, id=f"row{kind.row}-{name}") for name, kind in FAMILIES.items()]
SETTINGS = [pytest.param(row.name, options, id="-".join([row.name, *map(str, options.values())]))
            for row in rt.methods() for options in variants(row.name)
            if (row.name, options) != ("brute-force", {})]


def rays_of(name: str, full: bool) -> int:
    most = FAMILIES[name].most
    return min(most, QUICK) if not full else min(10 * most, FULL)


@functools.lru_cache(maxsize=4)
def traced(name: str, rays: int, seed: int) -> tuple[Case, rt.Hits]:
    """Returns a case and the hits of brute force."""
    case = make_case(name, rays, seed)
    return case, trace(case, "brute-force")


def trace(case: Case, method: str, **options) -> rt.Hits:
    with rt.Tracer(case.scene, method, **{**case.options.get(method, {}), **options}) as tracer:
        hits = tracer.trace(*case.rays)
    assert not hits.status.any(), "a ray reached its step cap"
    return hits


def check_right(name: str, rays: int, seed: int) -> None:
    case, hits = traced(name, rays, seed)
    verdict = judge(case.triangles, case.origins, case.directions, hits, case.t_min, case.t_max)
    assert not verdict.wrong.any(), (verdict.counts, np.flatnonzero(verdict.wrong)[:5])
    for values in (hits.t[hits.hit], hits.u, hits.v):
        assert np.isfinite(values).all()
    if case.closed:
        assert hits.hit.all(), f"{(~hits.hit).sum()} rays leak"


def check_method(name: str, method: str, options: dict, rays: int, seed: int) -> None:
    case, brute = traced(name, rays, seed)
    if options.get("build") == "goldsmith-salmon" and len(case.triangles) > SLOW_TO_INSERT:
        pytest.skip("this build inserts triangles singly, which is too slow here")
    if name == "long-way" and "loop" not in find_method(method).schedules:
        pytest.skip("this method would need a million passes")
    assert_same_bits(trace(case, method, **options), brute)


@pytest.mark.parametrize("seed", [1], ids="seed{}".format)
@pytest.mark.parametrize("name", NAMES)
def test_brute_force_is_right(name: str, seed: int) -> None:
    check_right(name, rays_of(name, False), seed)


@pytest.mark.parametrize("seed", [1], ids="seed{}".format)
@pytest.mark.parametrize("name, method", [
    pytest.param(name, row.name, id=f"row{FAMILIES[name].row}-{name}-{row.name}")
    for name in FAMILIES if name not in IN_FULL for row in rt.methods()
    if row.name != "brute-force" and ("loop" in row.schedules or name not in LONG_LISTS)])
def test_every_method_returns_the_bits_of_brute_force(precise_renderer, name: str, method: str,
                                                      seed: int) -> None:
    check_method(name, method, {}, rays_of(name, False), seed)


@pytest.mark.parametrize("seed", [1], ids="seed{}".format)
@pytest.mark.parametrize("method, options", [p for p in SETTINGS if p.values[1]])
@pytest.mark.parametrize("name", [p for p in NAMES if p.values[0] in TELLING])
def test_every_option_returns_the_bits_of_brute_force(precise_renderer, name: str, method: str,
                                                      options: dict, seed: int) -> None:
    """A method returns the bits of brute force with every choice of its options, except choices
    that may lose hits."""
    check_method(name, method, options, rays_of(name, False), seed)


@pytest.mark.small
@pytest.mark.parametrize("seed", [2], ids="seed{}".format)
@pytest.mark.parametrize("name", ["embree-vertices", "from-afar", "denormals", "slivers"])
@pytest.mark.parametrize("method", [row.name for row in rt.methods()])
def test_every_method_is_right(name: str, method: str, seed: int) -> None:
    """On every renderer, each method's hits are within the derived error bounds, and no ray leaks.
    The bits of the hits may differ between renderers."""
    case = make_case(name, 150, seed)
    hits = trace(case, method)
    verdict = judge(case.triangles, case.origins, case.directions, hits, case.t_min, case.t_max)
    assert not verdict.wrong.any(), verdict.counts
    assert hits.hit.all() or not case.closed


@pytest.mark.parametrize("seed", [3], ids="seed{}".format)
@pytest.mark.parametrize("quads", [2, 16, 64])
@pytest.mark.parametrize("method", [row.name for row in rt.methods()])
def test_row_5_squares(method: str, quads: int, seed: int) -> None:
    assert trace(square_case(quads, 2048, seed), method).hit.all()


@pytest.mark.parametrize("schedule", ["step", "kernels"])
@pytest.mark.parametrize("name", ["in-planes", "denormals", "flat-soup", *(
    pytest.param(name, marks=pytest.mark.full) for name in ("degenerate", "from-afar"))])
@pytest.mark.parametrize("method", [row.name for row in rt.methods()
                                    if {"step", "kernels"} <= set(row.schedules)])
def test_schedules_agree_at_the_extremes(precise_renderer, method: str, name: str,
                                         schedule: str) -> None:
    case, brute = traced(name, 512, 4)
    assert_same_bits(trace(case, method, schedule=schedule), brute)


# Full sizes --------------------------------------------------------------------------------------

@pytest.mark.full
@pytest.mark.once
@pytest.mark.parametrize("seed", [11, 12, 13], ids="seed{}".format)
@pytest.mark.parametrize("name", NAMES)
def test_brute_force_is_right_in_full(name: str, seed: int) -> None:
    check_right(name, rays_of(name, True), seed)


@pytest.mark.full
@pytest.mark.once
@pytest.mark.parametrize("seed", [11], ids="seed{}".format)
@pytest.mark.parametrize("method, options", SETTINGS)
@pytest.mark.parametrize("name", NAMES)
def test_every_method_in_full(precise_renderer, name: str, method: str, options: dict,
                              seed: int) -> None:
    # Options change how a method walks, but not its hits. An eighth of the rays is enough for
    # options.
    check_method(name, method, options, rays_of(name, True) // (8 if options else 1), seed)


@pytest.mark.full
@pytest.mark.once
@pytest.mark.parametrize("seed", [21], ids="seed{}".format)
@pytest.mark.parametrize("name", [name for name, kind in FAMILIES.items() if kind.row <= 4])
@pytest.mark.parametrize("method", [row.name for row in rt.methods()])
def test_rows_1_to_4_a_million_rays(name: str, method: str, seed: int) -> None:
    rays = 10**5 if method in UNSTRUCTURED else 10**6
    assert trace(make_case(name, rays, seed), method).hit.all()


@pytest.mark.full
@pytest.mark.once
@pytest.mark.parametrize("seed", range(31, 34), ids="seed{}".format)
@pytest.mark.parametrize("quads", [1, 2, 4, 8, 16, 32, 64, 181])
@pytest.mark.parametrize("method", [row.name for row in rt.methods()])
def test_row_5_squares_in_full(method: str, quads: int, seed: int) -> None:
    """No ray leaks through a square of 2 to 65,522 triangles. The methods trace 65,536 rays, but
    brute force traces 4,096 rays if there are 8,192 triangles or more."""
    rays = 4096 if method == "brute-force" and quads > 32 else 65_536
    assert trace(square_case(quads, rays, seed), method).hit.all()
