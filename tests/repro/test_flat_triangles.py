"""Rays miss triangles without area. In the past, rays hit them. The watertight test shears the
corners of a triangle. Rounding then moves one of three collinear corners off the line.

The fault appeared after the kitchen scene was moved by 10^4 times its extent. There, float32
flattens 12,000 triangles. Of 40,000 rays aimed at vertices, 41 hit such a triangle. The package
now shrinks triangles without area to points before the upload.
"""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.methods import find_method
from gpgpu_rt.options import TRACER_OPTIONS

TESTS = next(option.choices for option in TRACER_OPTIONS if option.name == "intersection")


# The quick suite tests the default of `intersection` with every method, and other values only with
# brute force and a packet method. The full suite tests all combinations.
CASES = [pytest.param(row.name, name, id=f"{row.name}-{name}",
                      marks=() if name == "woop-watertight" or row.name in (
                          "brute-force", "kd-packet") else pytest.mark.full)
         for row in rt.methods() for name in TESTS]


@pytest.mark.parametrize("seed", [1])
@pytest.mark.parametrize("method, intersection", CASES)
def test_three_corners_on_a_line_are_never_hit(method: str, intersection: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    start, step = rng.integers(-4000, 4000, (2, 300, 1, 3)) * 2.0 ** -12  # the sums are exact
    triangles = start + step * np.array((0, 2, 1))[:, None]
    scene = rt.Scene.from_arrays(triangles.reshape(-1, 3), np.arange(900).reshape(-1, 3))
    # A method without the schedule `loop` draws a pass per step, so fewer rays are traced.
    count = 20_000 if "loop" in find_method(method).schedules else 1000
    chosen = rng.integers(300, size=count)
    aims = start[chosen, 0] + step[chosen, 0] * rng.random((count, 1)) * 2
    origins = rng.normal(size=(count, 3))
    with rt.Tracer(scene, method, intersection=intersection) as tracer:
        assert not tracer.trace(origins, aims - origins).hit.any()
