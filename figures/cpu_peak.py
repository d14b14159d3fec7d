"""What the processor could compute, and what fragment programs reach of it."""
from __future__ import annotations

import functools
import time
from pathlib import Path
from typing import Any

import numpy as np

from gpgpu_rt.bench import roofline
from gpgpu_rt.gpu import open_gpu

# Single precision operations a core and a clock, by the widest vectors its flags name: two units
# that multiply and add (one multiplies and one adds where there is no fused form).
A_CLOCK = (("avx512f", 64), ("fma", 32), ("avx", 16), ("sse2", 8))
MATRIX = 768   # rows of the matrices whose product is timed


@functools.cache
def peak(count: int) -> dict[str, Any]:
    """What ``count`` threads could compute, in FLOP/s of single precision.

    Returns
    -------
    nominal : clock times operations a clock times threads, None where the clock is not known
    attained : of numpy's matrix product on all threads, the fastest of some
    fragments : of multiply-adds in fragment programs of the present renderer
    model, clock, a_clock, threads : what nominal is made of
    """
    facts = _cpuinfo()
    flags = facts.get("flags", "").split()
    a_clock = next((n for flag, n in A_CLOCK if flag in flags), None)
    clock = 1e6 * float(facts["cpu MHz"]) if "cpu MHz" in facts else None
    return {"nominal": clock * a_clock * count if clock and a_clock else None,
            "attained": _attained(), "fragments": _of_fragments(),
            "model": facts.get("model name"), "clock": clock, "a_clock": a_clock, "threads": count}


def _cpuinfo() -> dict[str, str]:
    """The first processor's entries, or nothing where the system does not tell them."""
    try:
        text = Path("/proc/cpuinfo").read_text().split("\n\n")[0]
    except OSError:
        return {}
    pairs = (line.split(":", 1) for line in text.splitlines() if ":" in line)
    return {key.strip(): value.strip() for key, value in pairs}


@functools.cache
def _of_fragments() -> float:
    return roofline.peaks(open_gpu()).flops


@functools.cache
def _attained() -> float:
    one = np.random.default_rng(0).random((MATRIX, MATRIX), np.float32)
    times = []
    for _ in range(6):
        began = time.perf_counter()
        one @ one
        times.append(time.perf_counter() - began)
    return 2.0 * MATRIX ** 3 / min(times)
