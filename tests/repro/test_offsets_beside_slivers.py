"""In the past, the offset of a new ray from its hit doubled until the ray missed its own triangle.
On long thin triangles, the offset was up to twice the necessary offset, and more than a thousandth
of the triangle's size. Now a bisection follows the doubling."""
from __future__ import annotations

import numpy as np
import pytest

from gpgpu_rt.hits import Hits
from gpgpu_rt.numerics.watertight import intersect_pairs
from gpgpu_rt.reference.spawn import spawn

# A triangle, u and v of a hit, and the direction of the new ray. The triangles are 1.2 and
# 2.3 million times as long as wide.
CASES = {
    "oblique": ([[-3613562.0, -517592.90625, -6403445.0],
                 [4833701.0, 2673205.5, -279685.78125],
                 [-1500310.25, 280645.84375, -4871454.5]],
                0.3499062657356262, 0.5369668006896973,
                [-0.5364239811897278, 1.2897677421569824, 0.5656829476356506]),
    "at-an-edge": ([[294425.84375, 823611.0, 8897.2021484375],
                    [-866957.0625, -193610.265625, -302429.8125],
                    [-290970.9375, 310878.75, -148028.34375]],
                   0.320659339427948, 0.005558268167078495,
                   [1.5673067569732666, -1.106242060661316, 0.8915361166000366]),
}


@pytest.mark.parametrize("name", CASES)
def test_the_offset_is_at_most_a_seventh_larger_than_necessary(name: str) -> None:
    corners, u, v, direction = (np.float32([value]) for value in CASES[name])
    hits = Hits(np.ones(1, np.float32), u, v, np.int32([0]), np.zeros(1, np.uint8))
    weights = np.concatenate((1 - u.astype(float) - v, u, v))
    point = weights @ corners[0].astype(float)
    start = spawn(corners, hits, direction)
    assert np.abs(start - point).max() < 1e-3 * np.abs(corners).max()
    nearer = np.float32(point + (start - point) * (7 / 8 - 1e-3))
    for origin, own in ((start, False), (nearer, True)):
        accepted, t, _, _ = intersect_pairs(corners, origin, direction)
        assert (accepted & (t >= 0)).all() == own
