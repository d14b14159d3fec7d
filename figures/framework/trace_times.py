"""Trace times: times a method's passes on a workload, and counts the work in a separate run.

Counting slows the passes down, so the timed runs do not count.
"""
from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from typing import Any

import gpgpu_rt as rt
from gpgpu_rt.bench.engines import EMBREE, ENGINES, Engine
from gpgpu_rt.bench.workloads import EYE, Workload, load, workload
from gpgpu_rt.workers.machine import alone

from ..experiments import cpu_peak
from .cell import ON_CPU, Cell

WARM_UPS = 1
PICTURE = "picture"   # the work of a whole picture: eye rays, shading and shadow rays


def measure(cell: Cell) -> dict[str, Any]:
    """Return the times of runs without counters, and the counters of one more run.

    For PICTURE, the counted run traces only the eye rays.
    """
    if cell.method == ON_CPU:
        return _embree(cell)
    scene = load(cell.scene)
    rays = workload(cell.scene, EYE if cell.work == PICTURE else cell.work, cell.size)
    with rt.Tracer(scene, cell.method, **dict(cell.options)) as tracer:
        def once() -> tuple[float, float, float]:
            if cell.work == PICTURE:
                tracer.render(size=(cell.size, cell.size))
            else:
                _trace(rays, tracer)
            took = tracer.statistics
            return took.trace_seconds, took.sort_seconds, took.driver.get("entry_seconds", 0.0)
        walls, parts = _runs(once, cell.runs)
        samples, sorts, beams = zip(*parts)
        cost = tracer.statistics.to_dict()
        structure = type(tracer.accelerator.structure).__name__
        with tracer.counting():
            _trace(rays, tracer)
        driver = tracer.statistics.driver
        # Counters are means over all pixels. A pixel without a ray counts zero. Each pixel of a
        # packet counts the packet's whole work. `share` converts a mean to the work per live ray,
        # and counts a packet's work once.
        width, height = tracer.options.get("packet", (1, 1))
        share = cell.size ** 2 / (max(rays.live, 1) * width * height)
        counters = {name: share * mean for name, mean in tracer.statistics.counters.items()}
    return {**_timing(samples, walls, rays.live),
            "sort_ms": _share_ms(samples, sorts), "beams_ms": _share_ms(samples, beams),
            "statistics": cost, "counters": counters, "driver": driver, "structure": structure}


def _share_ms(samples: Sequence[float], parts: Sequence[float]) -> float:
    """Return a part's milliseconds: its median share of a run, times the runs' median time."""
    share = statistics.median(part / whole for part, whole in zip(parts, samples))
    return 1e3 * statistics.median(samples) * share


def _runs(once: Callable[[], Any], count: int) -> tuple[list[float], list[Any]]:
    """Time ``count`` calls of ``once``, after warm-ups and alone on the machine.

    Returns the runs' seconds and return values.
    """
    for _ in range(WARM_UPS):
        once()
    walls, found = [], []
    with alone():
        for _ in range(count):
            began = time.perf_counter()
            found.append(once())
            walls.append(time.perf_counter() - began)
    return walls, found


def _trace(rays: Workload, tracer: rt.Tracer) -> None:
    """Trace a workload. With rasterised bounds, which need a camera, trace eye rays."""
    if tracer.options["rasterised_bounds"]:
        tracer.eye_hits(size=(rays.size, rays.size))
    else:
        rays.trace(tracer)


def _timing(samples: Sequence[float], walls: Sequence[float], rays: int) -> dict[str, Any]:
    median = statistics.median(samples)
    return {"rays": rays, "warm_ups": WARM_UPS, "samples_ms": [1e3 * s for s in samples],
            "median_ms": 1e3 * median, "wall_ms": 1e3 * statistics.median(walls),
            "ns_per_ray": 1e9 * median / max(rays, 1)}


def embree(threads: int = 1) -> Engine:
    modules = next(one.modules for one in ENGINES if one.name == EMBREE)
    mine = {one.threads: one for one in reversed(ENGINES) if one.modules == modules}
    if threads not in mine:
        raise rt.Error(f"embreex is measured on {' or '.join(map(str, sorted(mine)))} threads, "
                       f"not on {threads}")
    return mine[threads]


def _embree(cell: Cell) -> dict[str, Any]:
    rays, threads = workload(cell.scene, cell.work, cell.size), dict(
        cell.options).get("threads", 1)
    engine = embree(threads)
    if engine.missing:
        raise rt.Error(f"{engine.missing}; run `make setup`")
    samples, _ = _runs(engine.prepare(load(cell.scene), rays.compact()), cell.runs)
    with alone():
        peak = cpu_peak.peak(threads)
    return {**_timing(samples, samples, rays.live), "statistics": {}, "counters": {},
            "peak": peak}
