"""The CPU beside the cards: embreex on several threads, and what the processor could compute."""
from __future__ import annotations

import functools
import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.bench import embree_runner

BANDS = 8   # parts of the rays a thread, so that threads end together
# Single precision operations a core and a clock, by the widest vectors its flags name: two units
# that multiply and add (one multiplies and one adds where there is no fused form).
A_CLOCK = (("avx512f", 64), ("fma", 32), ("avx", 16), ("sse2", 8))
MATRIX = 768   # rows of the matrices whose product is timed


def threads() -> int:
    """Processors that this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def threaded_runner(scene: rt.Scene, origins: np.ndarray, directions: np.ndarray,
                    count: int) -> Callable[[], float] | None:
    """As `bench.embree_runner`, on ``count`` threads: rays in bands, each thread the next one.

    Embree leaves Python's lock while it traces, so threads do run at the same time.
    """
    origins, directions = origins.reshape(-1, 3), directions.reshape(-1, 3)
    ends = np.linspace(0, len(origins), BANDS * count + 1).astype(int)
    bands = [(origins[a:b], directions[a:b]) for a, b in zip(ends, ends[1:])]
    runners = [embree_runner(scene, *band) for band in bands]
    if None in runners:
        return None
    pool = ThreadPoolExecutor(count)

    def run() -> float:
        began = time.perf_counter()
        list(pool.map(lambda one: one() if one else 0.0, runners))
        return time.perf_counter() - began
    return run


@functools.cache
def peak(count: int) -> dict[str, Any]:
    """What ``count`` threads could compute, in FLOP/s of single precision.

    Returns
    -------
    nominal : clock times operations a clock times threads, None where the clock is not known
    attained : of numpy's matrix product on all threads, the fastest of some
    model, clock, a_clock, threads : what nominal is made of
    """
    facts = _cpuinfo()
    flags = facts.get("flags", "").split()
    a_clock = next((n for flag, n in A_CLOCK if flag in flags), None)
    clock = 1e6 * float(facts["cpu MHz"]) if "cpu MHz" in facts else None
    return {"nominal": clock * a_clock * count if clock and a_clock else None,
            "attained": _attained(), "model": facts.get("model name"), "clock": clock,
            "a_clock": a_clock, "threads": count}


def _cpuinfo() -> dict[str, str]:
    """The first processor's entries, or nothing where the system does not tell them."""
    try:
        text = Path("/proc/cpuinfo").read_text().split("\n\n")[0]
    except OSError:
        return {}
    pairs = (line.split(":", 1) for line in text.splitlines() if ":" in line)
    return {key.strip(): value.strip() for key, value in pairs}


@functools.cache
def _attained() -> float:
    one = np.random.default_rng(0).random((MATRIX, MATRIX), np.float32)
    times = []
    for _ in range(6):
        began = time.perf_counter()
        one @ one
        times.append(time.perf_counter() - began)
    return 2.0 * MATRIX ** 3 / min(times)
