"""Rows 16 to 19 of the catalogue of extreme cases (docs/extremes.md): rays along axes, rays in
planes of a lattice, flat scenes, and directions with denormal components. The tests of the lattice
compare the hits with hits in exact rational arithmetic."""
from __future__ import annotations

import functools

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.conform.case import Case
from gpgpu_rt.conform.families import make_case
from gpgpu_rt.conform.shapes import lattice

METHODS = [row.name for row in rt.methods()]
pytestmark = pytest.mark.small
CELLS = 4  # cells along each axis of the lattice. The whole lattice has 96 triangles.


def small_case(name: str, n: int, seed: int) -> Case:
    """Returns a case on a lattice of 4 cells along each axis. With the usual 8 cells along each
    axis, exact arithmetic is slow."""
    case = make_case(name, n, seed)
    return Case(lattice(CELLS), case.origins, case.directions)


@functools.lru_cache(maxsize=8)
def exact(name: str, n: int, seed: int, flushed: bool = False) -> rt.Hits:
    """Returns the exact hits. With ``flushed``, denormal components of directions count as 0."""
    case = small_case(name, n, seed)
    directions = case.directions
    if flushed:
        directions = np.where(np.abs(directions) < 2.0**-126, np.float32(0), directions)
    return rt.reference.trace_exact(case.triangles, case.origins, directions)


@pytest.mark.parametrize("seed", [1], ids="seed{}".format)
@pytest.mark.parametrize("name", ["signed-zeros", "slab-planes"])
@pytest.mark.parametrize("method", METHODS)
def test_rows_16_and_17_are_exact(method: str, name: str, seed: int) -> None:
    """A ray in a triangle's plane misses the triangle, as in exact arithmetic."""
    case, expected = small_case(name, 260, seed), exact(name, 260, seed)
    with rt.Tracer(case.scene, method) as tracer:
        hits = tracer.trace(case.origins, case.directions)
    assert expected.hit.any() and not expected.hit.all()
    assert np.array_equal(hits.hit, expected.hit)
    assert np.array_equal(hits.triangle, expected.triangle)
    assert np.array_equal(hits.t, expected.t.astype(np.float32))


@pytest.mark.parametrize("seed", [2], ids="seed{}".format)
@pytest.mark.parametrize("method", METHODS)
def test_row_19_denormal_components(method: str, seed: int) -> None:
    """Each hit is exact for the given direction, or for the direction with 0 in place of each
    denormal component."""
    case = small_case("denormals", 200, seed)
    with rt.Tracer(case.scene, method) as tracer:
        hits = tracer.trace(case.origins, case.directions)
    same = [(hits.triangle == e.triangle) & (hits.t == e.t.astype(np.float32))
            for e in (exact("denormals", 200, seed), exact("denormals", 200, seed, True))]
    assert (same[0] | same[1]).all()


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("method", METHODS)
def test_row_18_flat_scenes(method: str, axis: int) -> None:
    case = make_case("flat-box", 300, 3 + axis)
    with rt.Tracer(case.scene, method) as tracer:
        hits = tracer.trace(case.origins, case.directions)
    assert hits.hit.all()
    assert np.array_equal(hits.t, np.abs(case.triangles[0, 0, (2 + axis) % 3]
                                         - case.origins[:, (2 + axis) % 3]))
