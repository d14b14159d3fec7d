"""Tests that are skipped on ANGLE over SwiftShader, with their reasons."""
from __future__ import annotations

from collections.abc import Iterable

import pytest

# SwiftShader moves a vertex by up to half of 1/16 pixel. The tests below that have this reason
# draw images that are 48 to 96 pixels wide, and allow smaller errors than such a shift causes.
COARSE_VERTICES = ("SwiftShader moves vertices to a grid of 1/16 pixel (GL_SUBPIXEL_BITS is 4; "
                   "Mesa has 8), so interpolated values are less exact and neighbouring patches "
                   "overlap")
# `test_infinity_in_a_half_float_target` in tests/gl/test_angle.py shows this fault alone.
INFINITY_IS_LOST = ("SwiftShader draws infinity into a half-float target as NaN, so the ends of "
                    "sorted rays are lost; in 32 bits, sorted rays have the right hits")
# part of a test's name -> why the test is skipped
EXCEPTIONS: dict[str, str] = {
    "test_refraction.py::test_a_slab_changes_no_direction": COARSE_VERTICES,
    "test_ray_bundles.py::test_a_furnace[0.8-6]": COARSE_VERTICES,
    "test_ray_bundles.py::test_form_factor_of_squares[0.5-0.41525]": COARSE_VERTICES,
    "test_ray_bundles.py::test_form_factor_of_squares[1.0-0.19982]": COARSE_VERTICES,
    "test_sorted_rays.py::test_in_lower_precision[sort_rays-fp16]": INFINITY_IS_LOST,
}


def skip_exceptions(items: Iterable[pytest.Item]) -> None:
    """Mark the tests in ``EXCEPTIONS`` as skipped."""
    for item in items:
        for name, reason in EXCEPTIONS.items():
            if name in item.nodeid:
                item.add_marker(pytest.mark.skip(reason=reason))
