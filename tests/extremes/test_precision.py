"""Row 26 of the catalogue of extreme cases (docs/extremes.md): methods at low precision end within
their step cap, flag the rays that they stop, and report no false hit.

The tests use the precisions, roundings and interval policies of the option tables.
"""
from __future__ import annotations

import functools
import itertools

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.conform.case import Case
from gpgpu_rt.conform.families import make_case
from gpgpu_rt.gl.precision import FORMATS, Precision
from gpgpu_rt.numerics.error_bounds import Arithmetic, bound_pairs
from gpgpu_rt.options import TRACER_OPTIONS

OFFERED = {option.name: option.choices for option in TRACER_OPTIONS}
ROWS = {row.name: row for row in rt.methods()}
FAMILIES = ("sphere-edges", "spanning", "in-planes", "signed-zeros", "degenerate")
SETTINGS = [{word: low, "rounding": rounding} for word, low, rounding in itertools.product(
    ("precision", "storage"), ("fp24", "fp16"), OFFERED["rounding"])]
POLICIES = [(name, choice) for name, row in ROWS.items() for option in row.options
            if option.name == "interval" for choice in option.choices]


@functools.lru_cache(maxsize=2)
def case_of(name: str, seed: int) -> Case:
    return make_case(name, 400, seed)


def arithmetic(name: str, rounding: str) -> Arithmetic:
    """Returns the error bounds of a format. The unit roundoff of directed rounding is twice the
    unit roundoff of rounding to nearest."""
    form = FORMATS[name]
    return Arithmetic(form.unit * (1 if rounding == "nearest" else 2), form.smallest,
                      form.largest)


def wrong(case: Case, hits: rt.Hits, chosen: Precision) -> np.ndarray:
    """Returns (n,) bool: which hits are false.

    The format's arithmetic has error bounds. A hit is false if these bounds exclude a hit on the
    stored triangle, or if the error of t exceeds its bound. If 1 / det overflows the format, t is
    not checked.
    """
    at = np.flatnonzero(hits.hit)
    corners = chosen.stored(case.triangles[hits.triangle[at]])
    exponent = np.frexp(np.abs(case.directions[at]).max(axis=1))[1]
    origins = chosen.stored(case.origins[at])
    directions = chosen.stored(np.ldexp(case.directions[at], -exponent[:, None]))
    bounds = bound_pairs(corners, origins, directions,
                         arithmetic(chosen.arithmetic, chosen.rounding))
    v0, v1, v2 = corners.astype(np.float64).transpose(1, 0, 2)
    det = (np.cross(v1 - v0, v2 - v0) * directions).sum(axis=1) / np.abs(directions).max(axis=1)
    usual = np.abs(det) > 4 / FORMATS[chosen.arithmetic].largest
    t = np.ldexp(hits.t[at].astype(np.float64), exponent)
    kept = arithmetic(chosen.storage, chosen.rounding)  # storing t rounds t again
    off = np.abs(t - bounds.t) > bounds.t_bound + 2 * kept.unit * np.abs(t) + kept.tiny
    result = np.zeros(len(hits), bool)
    result[at] = ~bounds.possible | (usual & off)
    return result


def check(case: Case, method: str, ends: bool, **options) -> None:
    with rt.Tracer(case.scene, method, statistics=True, **options) as tracer:
        hits = tracer.trace(case.origins, case.directions)
        cap, chosen = tracer.step_cap, tracer.precision
    assert np.isin(hits.status, (0, 2)).all() and hits.steps.max() <= cap
    assert not ends or not hits.status.any(), f"{(hits.status == 2).sum()} rays looped"
    for values in (hits.t[hits.hit], hits.u, hits.v):
        assert np.isfinite(values).all()
    bad = wrong(case, hits, chosen)
    assert not bad.any(), f"{bad.sum()} hits are false, first {np.flatnonzero(bad)[:5]}"


def low_precisions() -> list:
    """Returns every case with every method in every setting. The quick suite runs only the most
    sensitive combinations. If storage has fewer bits than arithmetic, rays in kd-trees may
    loop."""
    combinations = []
    for name, method, options in itertools.product(FAMILIES, ROWS, SETTINGS):
        quick = name == "degenerate" and (
            options.get("precision") == "fp16" and options["rounding"] == "up"
            or options.get("storage") == "fp16" and options["rounding"] != "chop")
        combinations.append(pytest.param(
            name, method, options, id="-".join([name, method, *options, *options.values()]),
            marks=() if quick else pytest.mark.full))
    return combinations


@pytest.mark.parametrize("seed", [1], ids="seed{}".format)
@pytest.mark.parametrize("name, method, options", low_precisions())
def test_row_26_low_precision_ends(name: str, method: str, options: dict, seed: int) -> None:
    """If storage rounds up, the t_min of a ray in a kd-tree always increases, so no ray reaches
    the step cap. With other roundings, rays in kd-trees may loop until the cap stops and flags
    them."""
    ends = options["rounding"] == "up" or not method.startswith("kd-")
    cap = {} if ends else {"step_cap": 2000}
    check(case_of(name, seed), method, ends, **options, **cap)


@pytest.mark.parametrize("seed", [4], ids="seed{}".format)
@pytest.mark.parametrize("method", [name for name in ROWS if name in ("kd-restart",
                                                                      "kd-backtrack")])
def test_row_26_rays_loop_unless_storage_rounds_up(method: str, seed: int) -> None:
    """If storage rounds to nearest or chops, the stored t_min may lie before the split plane from
    which it was computed. Many rays then loop until the cap stops and flags them. The figure
    `extremes` shows the share of flagged rays for each rounding."""
    case = case_of("spanning", seed)
    shares = {}
    for rounding in ("nearest", "chop", "up"):
        with rt.Tracer(case.scene, method, storage="fp16", rounding=rounding,
                       step_cap=2000) as tracer:
            hits = tracer.trace(case.origins, case.directions)
        shares[rounding] = (hits.status == 2).mean()
    assert shares["nearest"] > 0.3 and shares["chop"] > 0.3 and shares["up"] == 0, shares


@pytest.mark.parametrize("seed", [2], ids="seed{}".format)
@pytest.mark.parametrize("method, policy", POLICIES)
@pytest.mark.parametrize("name", [
    name if name == "spanning" else pytest.param(name, marks=pytest.mark.full)
    for name in FAMILIES])
def test_row_26_interval_policies_end(name: str, method: str, policy: str, seed: int) -> None:
    """The cap stops and flags looping rays in fp32 under every interval policy."""
    check(case_of(name, seed), method, False, interval=policy, step_cap=2000)


def test_the_checks_find_false_hits() -> None:
    case = case_of("spanning", 3)
    for method in ROWS:
        check(case, method, True)
    with rt.Tracer(case.scene) as tracer:
        hits = tracer.trace(case.origins, case.directions)
    hits.t[1] *= np.float32(1.01)
    hits.triangle[2] += 1
    assert np.flatnonzero(wrong(case, hits, Precision())).tolist() == [1, 2]
