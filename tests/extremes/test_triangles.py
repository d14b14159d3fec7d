"""Rows 7 and 12 to 14 of the catalogue of extreme cases (docs/extremes.md): the unit triangle,
grazing rays, triangles without area, and identical triangles."""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.conform.case import Case
from gpgpu_rt.conform.families import make_case
from gpgpu_rt.numerics.error_bounds import distance_bound
from gpgpu_rt.options import TRACER_OPTIONS

METHODS = [row.name for row in rt.methods()]
INTERSECTIONS = next(o.choices for o in TRACER_OPTIONS if o.name == "intersection")
UNIT = np.float32([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]])


def trace(case: Case, method: str, **options) -> rt.Hits:
    with rt.Tracer(case.scene, method, **options) as tracer:
        hits = tracer.trace(case.origins, case.directions)
    assert not hits.status.any()
    return hits


@pytest.mark.small
@pytest.mark.parametrize("seed", [1], ids="seed{}".format)
@pytest.mark.parametrize("method", METHODS)
def test_row_7_the_unit_triangle(method: str, seed: int) -> None:
    """Rays meet interior points of the triangle at angles of less than 45 degrees to its normal. t
    is wrong by at most 16 float32 spacings, and u and v by at most 16 times 2^-24."""
    rng = np.random.default_rng(seed)
    points = rng.dirichlet((1, 1, 1), 300) @ UNIT[0].astype(np.float64)
    origins = (points + rng.uniform(-0.7, 0.7, (300, 3)) + [0, 0, 2]).astype(np.float32)
    case = Case(UNIT, origins, points - origins)
    hits = trace(case, method)
    exact = rt.reference.trace_exact(UNIT, case.origins, case.directions)
    inside = exact.hit & (np.minimum(exact.u, exact.v) > 1e-5) & (exact.u + exact.v < 1 - 1e-5)
    assert inside.mean() > 0.9 and hits.hit[inside].all()
    assert (np.abs(hits.t - exact.t) <= 16 * np.spacing(np.float32(exact.t)))[inside].all()
    for name in ("u", "v"):
        error = np.abs(getattr(hits, name) - getattr(exact, name))
        assert error[inside].max() <= 16 * 2.0**-24


@pytest.mark.small
@pytest.mark.parametrize("seed", [2], ids="seed{}".format)
@pytest.mark.parametrize("method", METHODS)
def test_row_12_grazing_hits_lie_in_the_box(method: str, seed: int) -> None:
    case = make_case("grazing", 1000, seed)
    hits = trace(case, method)
    at = np.flatnonzero(hits.hit)
    assert len(at) > 500
    corners = case.triangles[hits.triangle[at]].astype(np.float64)
    o, d = (a[at].astype(np.float64) for a in (case.origins, case.directions))
    bound = distance_bound(corners, o, d)
    # Compute the t of each corner along the dominant axis of the ray.
    axis = np.abs(d).argmax(axis=1)[:, None]
    depth = (np.take_along_axis(corners, axis[:, None], 2)[..., 0]
             - np.take_along_axis(o, axis, 1)) / np.take_along_axis(d, axis, 1)
    assert (hits.t[at] >= depth.min(axis=1) - bound).all()
    assert (hits.t[at] <= depth.max(axis=1) + bound).all()


@pytest.mark.parametrize("intersection", INTERSECTIONS)
@pytest.mark.parametrize("seed", [3], ids="seed{}".format)
@pytest.mark.parametrize("method", METHODS)
def test_row_13_no_area_is_never_hit(method: str, seed: int, intersection: str) -> None:
    case = make_case("degenerate", 500, seed)
    hits = trace(case, method, intersection=intersection)
    assert (hits.triangle == len(case.triangles) - 1).all(), "a ray missed the wall behind"
    for values in (hits.t, hits.u, hits.v):
        assert np.isfinite(values).all()


def test_row_14_ten_thousand_in_one_place() -> None:
    """Brute force returns the lowest index at equal distances. `test_catalogue.py` compares the
    other methods with brute force on the same triangles."""
    hits = trace(make_case("coincident", 100, 4), "brute-force")
    assert hits.hit.mean() > 0.5 and (hits.triangle[hits.hit] == 0).all()


@pytest.mark.small
@pytest.mark.parametrize("size", [2.0**-62, 2.0**-70, 2.0**-100])
@pytest.mark.parametrize("method", METHODS)
def test_triangles_below_the_stated_limit_are_missed_not_guessed(method: str, size: float) -> None:
    """A method may miss a triangle whose edge functions underflow, but must not return a hit with
    an infinite t."""
    case = make_case("one-triangle", 300, 5)
    origins = case.triangles[0].mean(axis=0) - case.directions
    hits = trace(Case(case.triangles * np.float32(size), origins * np.float32(size),
                      case.directions), method)
    assert np.isfinite(hits.t[hits.hit]).all()
    assert np.isfinite(hits.u).all() and np.isfinite(hits.v).all()
