"""Rows 8, 10 and 20 of the catalogue of extreme cases (docs/extremes.md): exact symmetries.

If a test scales a scene or the directions by a power of two, or permutes or mirrors the axes, each
ray still hits the same triangle. If the scene is scaled, t is multiplied exactly by the power. If
the directions are scaled, t is divided exactly by the power. Otherwise t stays the same.
"""
from __future__ import annotations

import itertools

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.conform.case import Case
from gpgpu_rt.conform.families import make_case, scaled
from gpgpu_rt.conform.shapes import bumpy_sphere

METHODS = [row.name for row in rt.methods()]
QUICK = (-20, 3, 20)
SYMMETRIES = list(itertools.product(itertools.permutations(range(3)),
                                    itertools.product((1, -1), repeat=3)))


def trace(case: Case, method: str) -> rt.Hits:
    with rt.Tracer(case.scene, method) as tracer:
        hits = tracer.trace(case.origins, case.directions)
    assert not hits.status.any()
    return hits


@pytest.mark.parametrize("exponent", [
    pytest.param(k, marks=() if k in QUICK else pytest.mark.full) for k in range(-20, 21) if k])
@pytest.mark.parametrize("method", METHODS)
def test_row_8_scaled_scenes(precise_renderer, method: str, exponent: int) -> None:
    plain, other = (trace(scaled(k, 500, 1), method) for k in (0, exponent))
    assert plain.hit.mean() > 0.9
    for name in ("triangle", "u", "v"):
        assert np.array_equal(getattr(plain, name), getattr(other, name)), name
    assert np.array_equal(np.ldexp(plain.t, exponent), other.t)


@pytest.mark.parametrize("scale", [
    1e-12, 7e3, 1e12, *(pytest.param(scale, marks=pytest.mark.full) for scale in (1e-6, 1e6))])
@pytest.mark.parametrize("method", METHODS)
def test_row_8_scaled_by_other_factors(method: str, scale: float) -> None:
    """Scaling by other factors rounds the corners, but the mesh stays closed and no ray leaks
    out."""
    case = make_case("sphere-edges", 1000, 2)
    triangles = (case.triangles.astype(np.float64) * scale).astype(np.float32)
    origins = (case.origins.astype(np.float64) * scale).astype(np.float32)
    assert trace(Case(triangles, origins, case.directions), method).hit.all()


@pytest.mark.small
@pytest.mark.parametrize("size", [1e-14, 1e17])
@pytest.mark.parametrize("method", METHODS)
def test_row_8_small_triangles_at_the_stated_limits(method: str, size: float) -> None:
    """At the limits that docs/extremes.md states for the size of a scene, t keeps all digits. The
    triangles have a thousandth of the scene's size, and the rays cross the scene."""
    rng = np.random.default_rng(5)
    middles, origins = rng.uniform(-0.5, 0.5, (2, 300, 3))
    triangles = middles[:, None] + 1e-3 * rng.normal(size=(300, 3, 3))
    case = Case((size * triangles).astype(np.float32), (size * origins).astype(np.float32),
                triangles.mean(axis=1) - origins)
    hits = trace(case, method)
    known = rt.reference.trace(case.triangles, case.origins, case.directions)
    same = hits.triangle == known.triangle
    assert known.hit.all() and same.mean() > 0.99
    assert np.median(np.abs(hits.t[same] / known.t[same] - 1)) < 2e-7


@pytest.mark.parametrize("exponent", [-140, -130, 127])
def test_row_20_t_past_float32(precise_renderer, exponent: int) -> None:
    """Directions of any length give the same hits, except for t, which may overflow to infinity or
    be rounded to a denormal."""
    rng = np.random.default_rng(6)
    # Multiples of 1/256 stay exact when they are scaled to denormals.
    directions = rng.integers(-256, 257, (500, 3)) / np.float32(256)
    case = Case(bumpy_sphere(1), 0.2 * rng.normal(size=(500, 3)), directions)
    plain = trace(case, "bvh-threaded")
    case.directions = np.ldexp(case.directions, exponent)
    hits = trace(case, "bvh-threaded")
    for name in ("triangle", "u", "v", "hit"):
        assert np.array_equal(getattr(plain, name), getattr(hits, name)), name
    with np.errstate(over="ignore"):
        assert np.array_equal(np.ldexp(plain.t, -exponent), hits.t)
    assert plain.hit.mean() > 0.9 and np.isinf(hits.t[hits.hit]).any() == (exponent < 0)


@pytest.mark.parametrize("method", METHODS)
def test_row_10_permuted_and_mirrored(precise_renderer, method: str) -> None:
    """The hits agree under ten of the 48 symmetries of the axes. The rays' directions are random.
    If the two largest components of a direction were equal, the choice of the dominant axis might
    not be symmetric."""
    rng = np.random.default_rng(3)
    triangles = bumpy_sphere(1)
    origins = (rng.normal(size=(600, 3)) * 0.5).astype(np.float32)
    directions = rng.normal(size=(600, 3)).astype(np.float32)
    plain = trace(Case(triangles, origins, directions), method)
    assert plain.hit.mean() > 0.7
    for order, signs in SYMMETRIES[::5]:
        turned = [np.ascontiguousarray(a[..., order] * np.float32(signs))
                  for a in (triangles, origins, directions)]
        hits = trace(Case(*turned), method)
        assert np.array_equal(hits.triangle, plain.triangle), (order, signs)
        assert np.array_equal(hits.t, plain.t), (order, signs)


@pytest.mark.parametrize("exponent", [
    -110, 11, 100, *(pytest.param(power, marks=pytest.mark.full) for power in (-50, 50))])
@pytest.mark.parametrize("method", METHODS)
def test_row_20_lengths_of_directions(precise_renderer, method: str, exponent: int) -> None:
    """If a direction is scaled by a power of two, t is divided exactly by this power. The powers
    range from 2^-110 to 2^100."""
    case = make_case("from-afar", 500, 4)
    plain = trace(case, method)
    case.directions = np.ldexp(case.directions, exponent)
    hits = trace(case, method)
    assert np.array_equal(plain.triangle, hits.triangle) and plain.hit.mean() > 0.9
    assert np.array_equal(np.ldexp(plain.t, -exponent), hits.t)
