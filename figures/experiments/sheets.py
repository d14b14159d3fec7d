"""Sheets: tests whether the Ray Engine finds the topmost square of a stack with tiny gaps.

Rays hit the squares from above. A depth buffer confuses hits at nearly equal distances.
"""
from __future__ import annotations

from typing import Any

import numpy as np

import gpgpu_rt as rt

# number of squares (sheets); height of the floor below the sheets
COUNT, FLOOR = 9, -7.0
FAR = 1.0 - FLOOR         # range of depth: from the highest ray origin to the floor
GAPS = tuple(range(-27, -20))       # the measured gaps are 2^k * FAR for these k
HEADS = ("gap / length", "wrong with MIN blending", "wrong with a depth buffer",
         "error of t / length, with a depth buffer")


def sheets(gap: float) -> rt.Scene:
    """A scene of COUNT squares, from height 0 upwards and ``gap`` apart, and the floor."""
    square = np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])[[0, 1, 2, 0, 2, 3]]
    height = (gap * np.arange(COUNT)).astype(np.float32)
    up = height[:, None, None] * np.float32([0, 0, 1])
    floor = np.float32([[-9, -9, FLOOR], [9, -9, FLOOR], [0, 9, FLOOR]])
    vertices = np.concatenate([(square + up).reshape(-1, 3), floor])
    return rt.Scene.from_arrays(vertices, np.arange(len(vertices)).reshape(-1, 3), name="sheets")


def rays(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(count, 3) origins, 0.5 to 1 above the lowest sheet, and directions downwards."""
    points = np.random.default_rng(seed).random((count, 3)).astype(np.float32)
    points[:, 2] = (1 + points[:, 2]) / 2
    return points, np.tile(np.float32([0, 0, -1]), (count, 1))


def measure(gap: float, nearest: str, count: int = 500, seed: int = 1) -> tuple[float, float]:
    """The share of rays whose hit is not on the topmost sheet, and the largest error of t."""
    origins, directions = rays(count, seed)
    with rt.Tracer(sheets(gap), "ray-engine", nearest=nearest) as tracer:
        hits = tracer.trace(origins, directions)
    top = origins[:, 2].astype(np.float64) - gap * (COUNT - 1)
    return float((hits.triangle // 2 != COUNT - 1).mean()), float(np.abs(hits.t - top).max())


def rows() -> list[list[Any]]:
    found = []
    for exponent in GAPS:
        gap = FAR * 2.0 ** exponent
        share, off = measure(gap, "depth")
        found.append([f"2^{exponent}", measure(gap, "blend")[0], share, off / FAR])
    return found
