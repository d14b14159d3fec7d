"""Tests that are skipped on ANGLE over SwiftShader, with their reasons."""
from __future__ import annotations

from collections.abc import Iterable

import pytest

# Half of 1/16 pixel is the largest error of a vertex. The tests below draw 48 to 96 pixels across
# and bound errors at about 1/100 of a pixel.
COARSE_VERTICES = ("SwiftShader moves vertices to a grid of 1/16 pixel (GL_SUBPIXEL_BITS is 4; "
                   "Mesa has 8), so interpolated values are less exact and neighbouring patches "
                   "overlap")
# part of a test's name -> why the test is skipped. None of these tests compares hits.
EXCEPTIONS: dict[str, str] = {
    "test_refraction.py::test_a_slab_changes_no_direction": COARSE_VERTICES,
    "test_ray_bundles.py::test_a_furnace[0.8-6]": COARSE_VERTICES,
    "test_ray_bundles.py::test_form_factor_of_squares[0.5-0.41525]": COARSE_VERTICES,
    "test_ray_bundles.py::test_form_factor_of_squares[1.0-0.19982]": COARSE_VERTICES,
}


def skip_exceptions(items: Iterable[pytest.Item]) -> None:
    """Mark the tests in ``EXCEPTIONS`` as skipped."""
    for item in items:
        for name, reason in EXCEPTIONS.items():
            if name in item.nodeid:
                item.add_marker(pytest.mark.skip(reason=reason))
