"""The suite's error bounds for fair engines hold for every triangle test of the project.

A fair engine rounds like float32, but its errors may be up to 16 times as large, because it may
lose four more bits. The rays of a fair engine may pass between two triangles at their common
edge, and then hit nothing or a triangle behind both. But no triangle test has a false hit or a
wrong t, except at slivers and at tiny triangles far from the ray.
"""
from __future__ import annotations

import pytest

import gpgpu_rt as rt
from gpgpu_rt.conform.answers import EngineAnswers
from gpgpu_rt.conform.case import FAMILIES
from gpgpu_rt.conform.suite import Known
from gpgpu_rt.options import TRACER_OPTIONS

TESTS = next(option.choices for option in TRACER_OPTIONS if option.name == "intersection")

# Pairs (triangle test, family) in which some hit exceeds the bounds of fair engines.
BEYOND = {("moller-trumbore", "slivers"), ("plucker", "slivers"), ("plucker", "stadium")}


@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.parametrize("intersection", TESTS)
def test_bounds_hold(intersection: str, name: str) -> None:
    known = Known.of(name, 150)
    with rt.Tracer(known.case.scene, "brute-force", intersection=intersection) as tracer:
        hits = tracer.trace(*known.case.rays)
    counts = known.judge(EngineAnswers(hits.triangle, hits.t), slice(None)).counts
    wrong = sum(counts[kind] for kind in ("false hit", "wrong t", "not finite"))
    assert bool(wrong) == ((intersection, name) in BEYOND), counts
