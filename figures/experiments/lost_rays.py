"""Lost rays: finds the eye rays that lose or change their hits in a method's number format.

The hits are compared with the hits of an exact method.
"""
from __future__ import annotations

import base64
from typing import Any

import numpy as np

import gpgpu_rt as rt

WORK = "lost rays"
EXACT = "bvh-packet"    # in fp32 all methods have the same hits


def measure(scene: rt.Scene, method: str, options: dict[str, Any], size: int) -> dict[str, Any]:
    """Return the numbers of wrong eye rays, a map of the wrong rays, and the error of t.

    ``hit`` counts the rays that should hit. Of these rays, ``lost`` counts those without a hit,
    and ``other`` those that hit another triangle. ``false`` counts the rays that hit but should
    miss. ``t_error`` is the median relative error of t over the rays with the right triangle, or
    None without such rays. ``map`` has two bit maps of the image in base64, row by row: the first
    marks the lost rays, the second the rays with a wrong hit.
    """
    rays = scene.camera.rays((size, size))
    with rt.Tracer(scene, EXACT) as tracer:
        exact = tracer.trace(*rays)
    with rt.Tracer(scene, method, **options) as tracer:
        found = tracer.trace(*rays)
    lost = exact.hit & ~found.hit
    wrong = found.hit & (found.triangle != exact.triangle)
    same = found.hit & ~wrong
    error = np.abs(found.t[same] / exact.t[same] - 1)
    return {"hit": int(exact.hit.sum()), "lost": int(lost.sum()),
            "other": int((wrong & exact.hit).sum()), "false": int((wrong & ~exact.hit).sum()),
            "t_error": float(np.median(error)) if same.any() else None,
            "map": base64.b64encode(np.packbits(np.stack([lost, wrong]))).decode()}


def wrong_pixels(result: dict[str, Any], size: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the pixels of lost rays and of wrong hits, (size, size) bool each."""
    bits = np.unpackbits(np.frombuffer(base64.b64decode(result["map"]), np.uint8))
    lost, wrong = bits[:2 * size * size].reshape(2, size, size).astype(bool)
    return lost, wrong
