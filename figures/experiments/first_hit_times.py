"""First hits from the rasteriser beside traced ones: time, what is in doubt, what is wrong."""
from __future__ import annotations

import statistics
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.traversal.stages.first_hits import FIRST_HITS
from gpgpu_rt.workers.machine import alone


def measure(scene: rt.Scene, method: str, options: dict[str, Any], size: int,
            runs: int) -> dict[str, dict[str, Any]]:
    """By where first hits come from: seconds of each run, taken in turns; rays in doubt; and rays
    whose hit differs from the traced one, as pixels counted row by row."""
    with rt.Tracer(scene, method, **options) as tracer:
        truth = tracer.eye_hits(size=(size, size))
        found: dict[str, dict[str, Any]] = {kind: {"seconds": []} for kind in FIRST_HITS}
        for kind, row in found.items():      # warms up too
            hits = tracer.eye_hits(size=(size, size), first_hits=kind)
            wrong = np.flatnonzero((hits.triangle != truth.triangle) | (hits.t != truth.t))
            row.update(tracer.statistics.first_hits, wrong=wrong.tolist())
        with alone():
            for _ in range(runs):
                for kind, row in found.items():
                    tracer.eye_hits(size=(size, size), first_hits=kind)
                    row["seconds"].append(tracer.statistics.trace_seconds)
    return found


def ratio(found: dict[str, dict[str, Any]], kind: str) -> float:
    """Times as fast as tracing: the median over the turns."""
    pairs = zip(found["traced"]["seconds"], found[kind]["seconds"])
    return statistics.median(traced / took for traced, took in pairs)
