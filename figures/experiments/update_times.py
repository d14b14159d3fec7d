"""Update times: measures how long a method takes to build its tables, and to update them."""
from __future__ import annotations

import statistics
import time
from collections.abc import Mapping
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.accel.cache import uncached
from gpgpu_rt.workers.machine import alone

SWAY = 0.01    # longest move of a corner, as a share of the scene's diagonal


def measure(scene: rt.Scene, method: str, options: Mapping[str, Any], runs: int) -> dict[str, Any]:
    """Measure the seconds of the first build, and of updates after all corners have moved.

    Returns
    -------
    build, update : float, seconds of the build, and the median seconds of an update
    rebuilt : bool, whether the last update rebuilt the structure
    size : float, bytes of all tables
    tables : list of str, the tables' names
    """
    still = scene.triangles
    diagonal = float(np.linalg.norm(np.ptp(still.reshape(-1, 3), axis=0)))
    seconds = []
    with alone(), uncached(), rt.Tracer(scene, method, **options) as tracer:
        build = tracer.statistics.build_seconds
        for turn in range(1, runs + 1):
            # A wave through space moves coincident corners alike.
            wave = np.sin(turn + 9 * still[..., ::-1] / diagonal)
            moved = still + np.float32(SWAY * diagonal / np.sqrt(3)) * wave
            began = time.perf_counter()
            tracer.update(moved.astype(np.float32))
            seconds.append(time.perf_counter() - began)
        return {"build": build, "update": statistics.median(seconds),
                "rebuilt": bool(tracer.statistics.rebuilt),
                "size": sum(tracer.statistics.table_bytes.values()),
                "tables": list(tracer.statistics.table_bytes)}
