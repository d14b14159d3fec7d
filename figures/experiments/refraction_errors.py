"""Refraction errors: compares image-space refraction with rays in float64 and with traced rays."""
from __future__ import annotations

import time
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.reference.refraction import refract, through_two_borders
from gpgpu_rt.render.image_space.refraction import LEFT, Refraction
from gpgpu_rt.scene.procedural.shapes import ball
from gpgpu_rt.workers.machine import alone

IOR = 1.5


def scene_of(name: str) -> rt.Scene:
    """Return the catalogue's scene of this name, or a sphere for "ball"."""
    if name != "ball":
        return rt.load_scene(name)
    corners = np.asarray(ball(20000), np.float32).reshape(-1, 3)
    return rt.Scene.from_arrays(corners, np.arange(len(corners)).reshape(-1, 3), name="ball")


def measure(name: str, method: str, options: dict[str, Any], size: int,
            runs: int) -> dict[str, Any]:
    """Compare image-space refraction in time with traced rays, and in direction with float64 rays.

    ``seconds`` has the times of two kinds of runs, which alternate: rasterised passes, and traced
    eye and refracted rays. ``triangles`` counts the scene's triangles. All other entries have a
    value per pixel, row by row. ``found`` is the direction of refracted light according to passes,
    and ``truth`` according to float64 rays; ``off`` is the angle between both in degrees. ``kind``
    (from passes) and ``right`` (from float64 rays) say what the pixel shows (refraction.py).
    """
    scene = scene_of(name)
    origins, directions = (r.reshape(-1, 3) for r in scene.camera.rays((size, size)))
    seconds: dict[str, list[float]] = {"rasterised": [], "traced": []}
    with rt.Tracer(scene, method, **options) as tracer:
        refraction = Refraction(tracer, IOR)

        def traced() -> float:
            hits = tracer.eye_hits(size=(size, size))
            took = tracer.statistics.trace_seconds
            hit = hits.hit
            normals = refraction.normals[hits.triangle[hit]].mean(axis=1)
            inside = refract(directions[hit], normals, 1 / IOR)[0]
            place = origins[hit] + hits.t[hit, None] * directions[hit]
            tracer.trace(place, inside, t_min=1e-4 * float(hits.t[hit].mean()))
            return took + tracer.statistics.trace_seconds
        found, kind = refraction.draw(size=(size, size))
        traced()
        with alone():
            for _ in range(runs):
                began = time.perf_counter()
                refraction.draw(size=(size, size))
                seconds["rasterised"].append(time.perf_counter() - began)
                seconds["traced"].append(traced())
        refraction.release()
    truth, right = through_two_borders(refraction.triangles, refraction.normals, origins,
                                       directions, IOR)
    found, kind = found.reshape(-1, 3), kind.reshape(-1)
    cosine = np.clip((found * truth).sum(1), -1, 1)
    off = np.where((kind == LEFT) & (right == LEFT), np.degrees(np.arccos(cosine)), np.nan)
    return {"seconds": seconds, "triangles": len(scene), "off": _numbers(off),
            "kind": kind.tolist(), "right": right.tolist(), "found": found.round(4).tolist(),
            "truth": truth.round(4).tolist()}


def _numbers(values: np.ndarray) -> list[float | None]:
    return [None if v != v else round(float(v), 4) for v in values]
