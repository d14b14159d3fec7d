"""Row 26, and precision at the extremes: a method may be wrong in few bits, but it ends within its
cap, flags the rays it stopped, and reports no hit that is not there.

Precisions, roundings and interval policies are those that the option tables offer.
"""
from __future__ import annotations

import functools
import itertools

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.figures.extreme_cases import Case, make_case
from gpgpu_rt.options import TRACER_OPTIONS

OFFERED = {option.name: option.choices for option in TRACER_OPTIONS}
PRECISIONS = OFFERED.get("precision") or OFFERED.get("storage") or ()
ROUNDINGS = OFFERED.get("rounding") or (None,)
WORD = "precision" if "precision" in OFFERED else "storage"
ROWS = {row.name: row for row in rt.methods()}
# Significant bits, and the share of the range in use from which values over- or underflow.
BITS = {"fp32": 24, "fp24": 17, "fp16": 11}
CASES = ("sphere-edges", "spanning", "in-planes", "signed-zeros", "degenerate")
SETTINGS = [{WORD: precision, **({"rounding": rounding} if rounding else {})}
            for precision, rounding in itertools.product(PRECISIONS, ROUNDINGS)
            if precision not in (None, "fp32")]
POLICIES = [(name, choice) for name, row in ROWS.items() for option in row.options
            if option.name == "interval" for choice in option.choices]


@functools.lru_cache(maxsize=2)
def case_of(name: str, seed: int) -> Case:
    return make_case(name, 400, seed)


def off_the_triangle(case: Case, hits: rt.Hits) -> np.ndarray:
    """Of each hit, how far o + t d lies from p(u, v) over the lengths that were added up, and how
    far u and v lie outside their triangle."""
    at = np.flatnonzero(hits.hit)
    v0, v1, v2 = case.triangles[hits.triangle[at]].astype(np.float64).transpose(1, 0, 2)
    u, v, t = (a[at, None].astype(np.float64) for a in (hits.u, hits.v, hits.t))
    o, d = (a[at].astype(np.float64) for a in (case.origins, case.directions))
    apart = np.linalg.norm(o + t * d - ((1 - u - v) * v0 + u * v1 + v * v2), axis=1)
    size = np.abs(o).sum(axis=1) + np.abs(t * d).sum(axis=1) + np.abs(v0).sum(axis=1)
    return np.maximum(apart / size, np.max([-u, -v, u + v - 1], axis=0)[:, 0])


def check(case: Case, method: str, bits: int, ends: bool, **options) -> None:
    with rt.Tracer(case.scene, method, statistics=True, **options) as tracer:
        hits = tracer.trace(case.origins, case.directions)
        cap = tracer.step_cap
    assert np.isin(hits.status, (0, 2)).all() and hits.steps.max() <= cap
    assert not ends or not hits.status.any(), f"{(hits.status == 2).sum()} rays went round"
    for values in (hits.t[hits.hit], hits.u, hits.v):
        assert np.isfinite(values).all()
    if hits.hit.any():
        # Rounding of the vertices, the origin and every step: some tens of units.
        assert off_the_triangle(case, hits).max() < 64 * 2.0**-bits


@pytest.mark.parametrize("seed", [1], ids="seed{}".format)
@pytest.mark.parametrize("options", SETTINGS, ids=lambda o: "-".join(map(str, o.values())))
@pytest.mark.parametrize("method", ROWS)
@pytest.mark.parametrize("name", CASES)
def test_row_26_low_precision_ends(name: str, method: str, options: dict, seed: int) -> None:
    """Rounded up, t_min of a kd-tree always moves on: no ray reaches its cap then. Otherwise rays
    may go round until the cap stops and flags them."""
    ends = options.get("rounding") == "up" or not method.startswith("kd-")
    cap = {} if ends else {"step_cap": 5000}
    check(case_of(name, seed), method, BITS[options[WORD]], ends, **options, **cap)


@pytest.mark.parametrize("seed", [2], ids="seed{}".format)
@pytest.mark.parametrize("method, policy", POLICIES)
@pytest.mark.parametrize("name", CASES)
def test_row_26_interval_policies_end(name: str, method: str, policy: str, seed: int) -> None:
    """In fp32, rays that go round are stopped and flagged, whatever the policy."""
    check(case_of(name, seed), method, 24, False, interval=policy, step_cap=5000)


def test_fp32_is_checked_alike() -> None:
    """The checks themselves, on what needs no option; and they notice a hit that is not there."""
    case = case_of("spanning", 3)
    for method in ROWS:
        check(case, method, 24, True)
    with rt.Tracer(case.scene) as tracer:
        hits = tracer.trace(case.origins, case.directions)
    hits.t[hits.hit] *= np.float32(1.01)
    assert off_the_triangle(case, hits).max() > 64 * 2.0**-24
