"""The bounds of clipped triangles equal the bounds of polygons that are cut plane by plane, as in
the method of Havran and Bittner."""
from __future__ import annotations

import numpy as np
import pytest

from gpgpu_rt.accel.clip import clip_bounds


def cut(triangle: np.ndarray, lo: np.ndarray, hi: np.ndarray) -> np.ndarray:
    """Return (n, 3) corners of the triangle's part in the box; n is 0 if no part is inside."""
    corners = list(triangle)
    for axis in range(3):
        for sign, plane in ((1, lo[axis]), (-1, hi[axis])):
            kept = []
            for a, b in zip(corners, corners[1:] + corners[:1]):
                inside = [sign * (p[axis] - plane) for p in (a, b)]
                if inside[0] >= 0:
                    kept.append(a)
                if inside[0] * inside[1] < 0:
                    kept.append(a + inside[0] / (inside[0] - inside[1]) * (b - a))
            corners = kept
    return np.reshape(corners, (-1, 3))


@pytest.mark.parametrize("seed", [1, 2], ids="seed{}".format)
@pytest.mark.parametrize("size", [0.3, 1, 8])
def test_bounds_equal_the_bounds_of_the_cut_polygon(size: float, seed: int) -> None:
    """Bounds are right for triangles that are smaller than the box, and for larger triangles.

    All corners of the largest triangles lie outside the box. If one of these triangles meets the
    box, usually edges of the box pierce the triangle.
    """
    rng = np.random.default_rng(seed)
    count = 500
    triangles = ((rng.random((count, 3, 3)) - 0.5) * size + 0.5).astype(np.float32)
    lo = (rng.random((count, 3)) * 0.5).astype(np.float32)
    hi = lo + (0.1 + rng.random((count, 3)) * 0.5).astype(np.float32)
    found_lo, found_hi = clip_bounds(triangles.transpose(1, 2, 0), np.arange(count), lo.T, hi.T)
    parts = [cut(*one) for one in zip(triangles.astype(np.float64), lo.astype(np.float64),
                                      hi.astype(np.float64))]
    some = np.array([len(part) > 0 for part in parts])
    assert 25 <= some.sum() and ((found_lo <= found_hi).all(axis=0) == some).all()
    for found, extreme in ((found_lo, np.min), (found_hi, np.max)):
        expected = np.array([extreme(part, axis=0) for part in parts if len(part)])
        assert np.abs(found.T[some] - expected).max() < 1e-6
