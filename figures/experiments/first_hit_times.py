"""First hit times: compares rasterised first hits with traced hits, in time and in errors.

The source "rasterised" proves that the rasteriser's hit is the ray's first hit. The source
"verified" only proves that the ray hits the triangle. If the proof fails, the ray is in doubt and
is traced afterwards.
"""
from __future__ import annotations

import statistics
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.traversal.stages.first_hits import FIRST_HITS
from gpgpu_rt.workers.machine import alone


def measure(scene: rt.Scene, method: str, options: dict[str, Any], size: int,
            runs: int) -> dict[str, dict[str, Any]]:
    """Measure the first hits from each source: traced, rasterised and verified (FIRST_HITS).

    Returns for each source the seconds of its runs, the number of rays in doubt, and the indices
    (row by row) of pixels that differ from the traced hits. The runs of the sources alternate.
    """
    with rt.Tracer(scene, method, **options) as tracer:
        truth = tracer.eye_hits(size=(size, size))
        found: dict[str, dict[str, Any]] = {kind: {"seconds": []} for kind in FIRST_HITS}
        for kind, row in found.items():      # these calls also warm up the timed calls
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
    """Return the tracing time divided by the time of a source, as the median over all runs."""
    pairs = zip(found["traced"]["seconds"], found[kind]["seconds"])
    return statistics.median(traced / took for traced, took in pairs)
